def minutes(rule, config, view="", size=0): return 30
def megabytes(rule, config, view="", size=0): return 2000

"""One job per heart: its measures, and whether they are within bounds; changed bounds do not run mechanics again."""


rule physiology:
    input:
        record("mechanics"),
    output:
        record("physiology"),
    params:
        code=code("physiology"),
        settings=lambda wildcards: settings_version(CASES[wildcards.case].config.physiology),
    log:
        FOLDER / "logs/physiology/{case}.log",
    shell:
        "{RUN}/physiology.py {FOLDER} {wildcards.case} &> {log}"

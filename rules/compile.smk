"""Functions compiled once: one cache a group of stages and version of their code, filled before their first jobs.

The jobs that fill it are nobody's input. Snakemake looks no further below a rule that is to run again, and runs again
what has another input than before; so a job looks for the mark itself, and fills the cache where it is the first.
"""

CACHE = {group: f".snakemake/numba/{folder(group, SCRIPTS)}" for group in GROUPS}
SMALL = miniature(next(iter(CASES.values())).config)
KINDS = {
    "imaging": (*SMALL.views.values(), SMALL.phantom, SMALL.probe, SMALL.rf, SMALL.realism, SMALL.bmode, SMALL.motion),
    "tracking": (SMALL.tracking, SMALL.bmode),
}
MARKS = {group: f"{CACHE[group]}/{settings_version(*kinds)}" for group, kinds in KINDS.items()}


def compiled(group):
    """Shell commands that let what follows find its compiled functions, and compile them where nobody has."""
    variable = f"export NUMBA_CACHE_DIR={quote(str(Path(CACHE[group]).absolute()))}"
    if group not in MARKS:
        return variable
    return f"{variable}; [ -e {MARKS[group]} ] || {RUN}/compile.py {FOLDER} {group} {MARKS[group]}"


COMPILED = {group: compiled(group) for group in GROUPS}


rule compile_imaging:
    output:
        MARKS["imaging"],
    log:
        FOLDER / "logs/compile_imaging.log",
    priority: 2
    shell:
        "{{ {COMPILED[imaging]}; }} &> {log}"


rule compile_tracking:
    output:
        MARKS["tracking"],
    log:
        FOLDER / "logs/compile_tracking.log",
    priority: 1
    shell:
        "{{ {COMPILED[tracking]}; }} &> {log}"

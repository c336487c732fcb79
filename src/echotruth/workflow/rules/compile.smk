"""Compile functions once: one cache per group of stages and version of their code, filled before their first jobs.

The jobs that fill the caches are not inputs of other rules: Snakemake does not check the inputs of a rule that it runs
again, and runs again whatever has other inputs than before. Instead, every job checks the mark of its cache itself, and
fills the cache if the mark does not exist.
"""

HANDED = quote(str(configuration_path(FOLDER, CONFIG)))
CACHE = {group: f".snakemake/numba/{cache_folder(group, SCRIPTS)}" for group in CACHE_GROUPS}
MINI = miniature(single(CONFIG))
COMPILE_SETTINGS = {
    "imaging": (*MINI.views.values(), MINI.phantom, MINI.probe, MINI.rf, MINI.realism, MINI.bmode, MINI.motion),
    "tracking": (MINI.tracking, MINI.bmode),
}
MARKS = {group: f"{CACHE[group]}/{settings_version(*sections)}" for group, sections in COMPILE_SETTINGS.items()}


def compile_command(group):
    """Shell commands that set the cache for the following commands, and fill it if it is not filled yet."""
    variable = f"export NUMBA_CACHE_DIR={quote(str(Path(CACHE[group]).absolute()))}"
    if group not in MARKS:
        return variable
    return f"{variable}; [ -e {MARKS[group]} ] || {RUN}/compile.py {FOLDER} {group} {MARKS[group]} --config {HANDED}"


COMPILE = {group: compile_command(group) for group in CACHE_GROUPS}


rule compile_imaging:
    output:
        MARKS["imaging"],
    log:
        FOLDER / "logs/compile_imaging.log",
    priority: 2
    resources:
        runtime=10,
        mem_mb=2000,
    shell:
        "{{ {COMPILE[imaging]}; }} &> {log}"


rule compile_tracking:
    output:
        MARKS["tracking"],
    log:
        FOLDER / "logs/compile_tracking.log",
    priority: 1
    resources:
        runtime=10,
        mem_mb=2000,
    shell:
        "{{ {COMPILE[tracking]}; }} &> {log}"

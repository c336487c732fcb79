"""Compile functions once: one cache per group of stages and version of their code, that of the views filled before them.

The job that fills this cache is not an input of other rules: Snakemake does not check the inputs of a rule that it runs
again, and runs again whatever has other inputs than before. Instead, every job of a view checks the mark of the cache
itself, and fills the cache if the mark does not exist.
"""

HANDED = quote(str(configuration_path(FOLDER, CONFIG)))
CACHE = {group: f".snakemake/numba/{cache_folder(group, SCRIPTS)}" for group in CACHE_GROUPS}
MINI = miniature(single(CONFIG))
MARK = "{}/{}".format(
    CACHE["view"],
    settings_version(
        *MINI.views.values(), MINI.phantom, MINI.probe, MINI.rf, MINI.realism, MINI.bmode, MINI.motion, MINI.tracking
    ),
)


def compile_command(group):
    """Shell commands that set the cache for the following commands, and fill it if it is not filled yet."""
    variable = f"export NUMBA_CACHE_DIR={quote(str(Path(CACHE[group]).absolute()))}"
    fill = f"; [ -e {MARK} ] || {RUN}/compile.py {FOLDER} {MARK} --config {HANDED}"
    return variable + fill if group == "view" else variable


COMPILE = {group: compile_command(group) for group in CACHE_GROUPS}


rule compile:
    output:
        MARK,
    log:
        FOLDER / "logs/compile.log",
    priority: 2
    resources:
        runtime=10,
        mem_mb=2000,
    shell:
        "{{ {COMPILE[view]}; }} &> {log}"

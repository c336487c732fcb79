"""One job per heart: geometry, fibres, mechanics and kinematics."""


rule mechanics:
    output:
        record("mechanics"),
    params:
        code=code("mechanics"),
        settings=lambda wildcards: mechanics_settings(CASES[wildcards.case].config),
    log:
        FOLDER / "logs/mechanics/{case}.log",
    # One core is left for the jobs that compile at the same time.
    threads: max(1, ((workflow.cores or 1) - any(not Path(mark).exists() for mark in MARKS.values())) // len(CASES))
    priority: 3
    shell:
        """
        {{
            {COMPILE[mechanics]}
            {RUN}/mechanics.py {FOLDER} {wildcards.case} --threads {threads}
        }} &> {log}
        """


@cache
def loop_curves(loop):
    """Time and prescribed curves of a loop, read once for all hearts that share it."""
    cycle = read_loop(loop)
    curves = (cycle.time, cycle.pressure, cycle.volume, cycle.tension)
    return [None if values is None else values.tolist() for values in curves]


def mechanics_settings(config):
    # Only fibre disarray depends on the seed.
    seed = config.seed if config.fibres.disarray_deg else None
    anatomy = (config.geometry.resolved(), fingerprint(config.geometry), config.fibres, seed, config.pathology)
    if config.motion.kind == "beat":
        return settings_version(*anatomy, config.loop, loop_curves(config.loop), config.mechanics)
    formula = getattr(config.motion, config.motion.kind)
    if config.motion.kind == "file":
        formula = settings_version(formula, content_hash(config.motion.file.path))
    amplitude = (loop_curves(config.loop)[0], config.motion.time_course)
    return settings_version(*anatomy, *amplitude, formula, config.rf.focus_mm)

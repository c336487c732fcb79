"""One job a heart: geometry, fibres, mechanics and kinematics."""


rule mechanics:
    output:
        record("mechanics"),
    params:
        code=code("mechanics"),
        settings=lambda wildcards: mechanics_settings(CASES[wildcards.case].config),
    log:
        FOLDER / "logs/mechanics/{case}.log",
    # One core is left to what compiles meanwhile.
    threads: max(1, ((workflow.cores or 1) - any(not Path(mark).exists() for mark in MARKS.values())) // len(CASES))
    priority: 3
    shell:
        """
        {{
            {COMPILED[mechanics]}
            {RUN}/mechanics.py {FOLDER} {wildcards.case} --threads {threads}
        }} &> {log}
        """


@cache
def course(loop):
    """Time and what is prescribed of a loop, read once for all hearts that it drives."""
    read = read_loop(loop)
    prescribed = (read.time, read.pressure, read.volume, read.tension)
    return [None if values is None else values.tolist() for values in prescribed]


def mechanics_settings(config):
    # The seed enters by the disarray of the fibres alone.
    seed = config.seed if config.fibres.disarray_deg else None
    anatomy = (config.geometry.settled(), fingerprint(config.geometry), config.fibres, seed, config.pathology)
    if config.motion.kind == "beat":
        return settings_version(*anatomy, config.loop, course(config.loop), config.mechanics)
    formula = getattr(config.motion, config.motion.kind)
    return settings_version(*anatomy, course(config.loop)[0], config.motion.course, formula, config.rf.focus_mm)

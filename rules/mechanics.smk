"""One job a heart: geometry, fibres, mechanics and kinematics."""


rule mechanics:
    output:
        record("mechanics"),
    params:
        code=code("mechanics"),
        settings=lambda wildcards: mechanics_settings(CASES[wildcards.case].config),
    log:
        FOLDER / "logs/mechanics/{case}.log",
    threads: max(1, (workflow.cores or 1) // len(CASES))
    shell:
        "{RUN}/mechanics.py {FOLDER} {wildcards.case} --threads {threads} 2>&1 | tee {log}"


def mechanics_settings(config):
    loop = read_loop(config.loop)
    course = [values.tolist() for values in (loop.time, loop.pressure, loop.volume)]
    return settings_version(config.geometry, config.fibres, config.loop, course, config.mechanics)

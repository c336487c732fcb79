"""One job per heart: geometry, fibres, mechanics and kinematics.

Of hearts with the same motion only the first is solved; the others take over its files. The process also measures the
heart, because starting another takes longer than that; the rule physiology finds the record.
"""

MOTIONS = motions({id: case.config for id, case in CASES.items()})
SAME_AS = first_with_same(MOTIONS, rows(FOLDER / "registry.txt"))


def heart_group(wildcards):
    """Group of the jobs of a heart on a cluster; those that only take over files are many to a group."""
    return "shared" if wildcards.case in SAME_AS else "heart"

MECHANICS = handed("mechanics", "physiology")


rule mechanics:
    input:
        # Not `ancient`: if the first is to be solved again, Snakemake does not look for reasons to run the others.
        lambda wildcards: [record("mechanics", case) for case in same_as(wildcards)],
    output:
        record("mechanics"),
    params:
        code("mechanics"),
        lambda wildcards: MOTIONS[wildcards.case],
    group:
        heart_group
    log:
        FOLDER / "logs/mechanics/{case}.log",
    # One core is left for the job that compiles at the same time.
    threads: max(1, ((workflow.cores or 1) - (not Path(MARK).exists())) // len(CASES))
    priority: 3
    resources:
        runtime=minutes("mechanics"),
        mem_mb=megabytes("mechanics"),
    shell:
        """
        {{
            {COMPILE[mechanics]}
            {RUN}/series.py {FOLDER} {wildcards.case} mechanics {SOURCE_OF_MOTION:{wildcards.case}} {MECHANICS:{wildcards.case}} --threads {threads} \\
                --then physiology --ahead {PHYSIOLOGY_AHEAD:{wildcards.case}}
        }} &> {log}
        """


def same_as(wildcards):
    """The case from which a case takes over its motion, if there is one."""
    return [SAME_AS[wildcards.case]] if wildcards.case in SAME_AS else []


SOURCE_OF_MOTION = OfCase(lambda case: f"--same-as {SAME_AS[case]}" if case in SAME_AS else "")

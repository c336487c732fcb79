"""One job per heart: its measures, and whether they are within bounds; changed bounds do not run mechanics again.

The job of the mechanics has mostly done this already. Then its record is only moved to the ledger.
"""

PHYSIOLOGY = handed("physiology")


rule physiology:
    input:
        record("mechanics"),
    output:
        record("physiology"),
    params:
        code("physiology"),
        lambda wildcards: physiology_settings(wildcards.case),
    group:
        heart_group
    log:
        FOLDER / "logs/physiology/{case}.log",
    resources:
        runtime=minutes("mechanics"),
        mem_mb=megabytes("mechanics"),
    shell:
        """
        {{
            if [ -e {PHYSIOLOGY_AHEAD:{wildcards.case}}/physiology.json ] && [ ! -e {PHYSIOLOGY_AHEAD:{wildcards.case}}/begun ]; then
                mv {PHYSIOLOGY_AHEAD:{wildcards.case}}/physiology.json {output}
            else
                {COMPILE[mechanics]}
                {RUN}/physiology.py {FOLDER} {wildcards.case} {PHYSIOLOGY:{wildcards.case}}
            fi
            rm -rf $(dirname {PHYSIOLOGY_AHEAD:{wildcards.case}})/ahead-*
        }} &> {log}
        """


def physiology_settings(case):
    return settings_version(CASES[case].config.physiology)


def physiology_ahead(case):
    """Folder in which the job of the mechanics leaves the record, if it is of this code and these settings."""
    version = f"{code('physiology')}-{physiology_settings(case)}"
    return str(FOLDER / "scratch" / case / f"ahead-{version}")


PHYSIOLOGY_AHEAD = OfCase(physiology_ahead)

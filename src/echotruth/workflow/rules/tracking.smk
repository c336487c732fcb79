"""One job per heart and view: every tracker at every image size, scored against the truth.

The job of the images has mostly done this already. Then its records are only moved to the ledger.
"""

TRACKING_CODE = code("tracking", "evaluation")

TRACKING = handed("tracking", "evaluation")


rule tracking:
    input:
        record("bmode", view="{view}"),
    output:
        tracking=record("tracking", view="{view}"),
        evaluation=record("evaluation", view="{view}"),
    params:
        code("tracking", "evaluation"),
        lambda wildcards: tracking_settings(wildcards.case),
    group:
        "view"
    priority: 1
    log:
        FOLDER / "logs/tracking/{case}/{view}.log",
    resources:
        runtime=minutes("tracking"),
        mem_mb=megabytes("tracking"),
    shell:
        """
        {{
            ahead={TRACKING_AHEAD:{wildcards.case}/{wildcards.view}/}
            if [ -e $ahead/tracking.json ] && [ -e $ahead/evaluation.json ] && [ ! -e $ahead/begun ]; then
                mv $ahead/tracking.json {output.tracking}
                mv $ahead/evaluation.json {output.evaluation}
            else
                {COMPILE[view]}
                {RUN}/series.py {FOLDER} {wildcards.case} tracking evaluation --view {wildcards.view} {TRACKING:{wildcards.case}} \\
                    --threads {threads}
            fi
            rm -rf $(dirname $ahead)/ahead-*
        }} &> {log}
        """


@cache
def settings_of_step(step):
    """Hash of the trackers' settings for a step between frames, which may differ between cases."""
    return settings_version(CONFIG.tracking.model_copy(update={"frame_step": step}))


def tracking_settings(case):
    return settings_of_step(CASES[case].config.tracking.frame_step)


def tracking_ahead(path):
    """Folder in which the job of the images leaves the records, if they are of this code and these settings."""
    case = path.partition("/")[0]
    return str(FOLDER / "scratch" / path / f"ahead-{TRACKING_CODE}-{tracking_settings(case)}")


TRACKING_AHEAD = OfCase(tracking_ahead)

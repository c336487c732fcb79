"""One job per heart and view: phantom, truth, RF and B-mode of all frames and image sizes.

The stages are one job because starting a process takes longer than passing arrays through a scratch folder. What a stage
made stands if the next one is killed, and is taken up. The process also tracks and scores the clips; the rule tracking
finds the records.
"""

IMAGING = handed("phantom", "truth", "rf", "bmode", "tracking", "evaluation")


def longest_first(wildcards):
    """Priority of a view, from 0 to 1: its expected time over that of the longest."""
    config = CASES[wildcards.case].config
    seconds = {view: cost.seconds("rf", config, view) for view in config.views}
    return seconds[wildcards.view] / max(seconds.values())


rule imaging:
    input:
        record("physiology"),
    output:
        record("phantom", view="{view}"),
        record("truth", view="{view}"),
        record("rf", view="{view}"),
        record("bmode", view="{view}"),
    params:
        code("phantom", "truth", "rf", "bmode"),
        lambda wildcards: imaging_settings(CASES[wildcards.case].config, wildcards.view),
    group:
        "view"
    # A core that has nothing left to do waits for the longest view, of one heart; of many, hearts are finished in turn.
    priority: longest_first if len(CASES) == 1 else 0
    log:
        FOLDER / "logs/imaging/{case}/{view}.log",
    resources:
        runtime=minutes("rf"),
        mem_mb=megabytes("rf"),
    shell:
        """
        {{
            {COMPILE[view]}
            {RUN}/series.py {FOLDER} {wildcards.case} phantom truth rf bmode --view {wildcards.view} {IMAGING:{wildcards.case}} \\
                --threads {threads} --then tracking evaluation --ahead {TRACKING_AHEAD:{wildcards.case}/{wildcards.view}/}
        }} &> {log}
        """

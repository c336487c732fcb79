"""One job per heart and view: phantom, truth, RF and B-mode of all frames and image sizes.

The stages are one job because starting a process takes longer than passing arrays through a scratch folder. What a stage
made stands if the next one is killed, and is taken up. The process also tracks and scores the clips; the rule tracking
finds the records.
"""

IMAGING = handed("phantom", "truth", "rf", "bmode", "tracking", "evaluation")


rule imaging:
    input:
        record("physiology"),
    output:
        phantom=record("phantom", view="{view}"),
        truth=record("truth", view="{view}"),
        rf=record("rf", view="{view}"),
        bmode=record("bmode", view="{view}"),
    params:
        code=code("phantom", "truth", "rf", "bmode"),
        settings=lambda wildcards: imaging_settings(CASES[wildcards.case].config, wildcards.view),
    group:
        "view"
    log:
        FOLDER / "logs/imaging/{case}/{view}.log",
    resources:
        runtime=minutes(demand.images),
        mem_mb=megabytes(demand.images),
    shell:
        """
        {{
            {COMPILE[tracking]}
            {COMPILE[imaging]}
            {RUN}/series.py {FOLDER} {wildcards.case} phantom truth rf bmode --view {wildcards.view} {IMAGING:{wildcards.case}} \\
                --threads {threads} --then tracking evaluation --ahead {TRACKING_AHEAD:{wildcards.case}/{wildcards.view}/} --cache {TRACKING_CACHE}
        }} &> {log}
        """

"""One job a heart and view: phantom, truth, RF and B-mode, all frames and image sizes in one go.

The stages stand in one job because a job's start costs more than handing arrays on through a scratch folder.
"""


rule imaging:
    input:
        record("physiology"),
    output:
        phantom=record("phantom", view="{view}"),
        truth=record("truth", view="{view}"),
        rf=record("rf", view="{view}"),
        bmode=record("bmode", view="{view}"),
    params:
        # A string, for Snakemake fills in wildcards in strings alone.
        scratch=str(FOLDER / "scratch/{case}/{view}"),
        code=code("phantom", "truth", "rf", "bmode"),
        settings=lambda wildcards: imaging_settings(CASES[wildcards.case].config, wildcards.view),
    log:
        FOLDER / "logs/imaging/{case}/{view}.log",
    shell:
        """
        {{
            rm -rf {params.scratch}
            {COMPILED[imaging]}
            {RUN}/series.py {FOLDER} {wildcards.case} {wildcards.view} phantom truth rf bmode --threads {threads}
            rm -rf {params.scratch}
        }} &> {log}
        """


def imaging_settings(config, view):
    place = list(config.views).index(view)
    stages = (config.phantom, config.probe.settled(), config.rf, config.realism, config.bmode)
    return settings_version(config.seed, config.views[view], place, *stages)

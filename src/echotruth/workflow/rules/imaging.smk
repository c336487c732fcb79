"""One job per heart and view: phantom, truth, RF and B-mode of all frames and image sizes.

The stages are one job because starting a job takes longer than passing arrays through a scratch folder.
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
        # A string, because Snakemake replaces wildcards only in strings.
        scratch=str(FOLDER / "scratch/{case}/{view}"),
        code=code("phantom", "truth", "rf", "bmode"),
        settings=lambda wildcards: imaging_settings(CASES[wildcards.case].config, wildcards.view),
    log:
        FOLDER / "logs/imaging/{case}/{view}.log",
    shell:
        """
        {{
            rm -rf {params.scratch}
            {COMPILE[imaging]}
            {RUN}/series.py {FOLDER} {wildcards.case} {wildcards.view} phantom truth rf bmode --threads {threads}
            rm -rf {params.scratch}
        }} &> {log}
        """


def imaging_settings(config, view):
    index = list(config.views).index(view)
    stages = (config.phantom, config.probe.resolved(), config.rf, config.realism, config.bmode)
    return settings_version(config.seed, config.views[view], index, *stages)

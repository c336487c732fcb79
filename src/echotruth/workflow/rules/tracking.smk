"""One job per heart and view: every tracker at every image size, scored against the truth."""


rule tracking:
    input:
        record("bmode", view="{view}"),
    output:
        tracking=record("tracking", view="{view}"),
        evaluation=record("evaluation", view="{view}"),
    params:
        code=code("tracking", "evaluation"),
        settings=settings_version(CONFIG.tracking),
    log:
        FOLDER / "logs/tracking/{case}/{view}.log",
    shell:
        """
        {{
            {COMPILE[tracking]}
            {RUN}/series.py {FOLDER} {wildcards.case} {wildcards.view} tracking evaluation --threads {threads}
        }} &> {log}
        """

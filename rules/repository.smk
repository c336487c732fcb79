"""Cases and arrays before the first heart; attributes, verification and the ledger's verdict after the last."""


rule cases:
    output:
        # Not the registry: Snakemake removes outputs before it runs a rule again, and rows are for ever.
        table=FOLDER / "cases.csv",
        config=FOLDER / "config.yaml",
    params:
        config=CONFIG.model_dump_json(),
        code=code("cases"),
    log:
        FOLDER / "logs/cases.log",
    shell:
        "printf %s {params.config:q} | {RUN}/cases.py {FOLDER} - 2>&1 | tee {log}"


rule repository:
    input:
        rules.cases.output,
        expand(record("mechanics"), case=CASES),
        expand(record("evaluation", view="{view}"), case=CASES, view=CONFIG.views),
    output:
        FOLDER / "ledger/repository.json",
    params:
        code=code("repository"),
    log:
        FOLDER / "logs/repository.log",
    shell:
        "{RUN}/repository.py {FOLDER} 2>&1 | tee {log}"

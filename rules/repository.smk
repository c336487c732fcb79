"""The repository: every file verified against the ledger, verdicts and attributes written."""


rule repository:
    input:
        PLAN.records,  # of all jobs, also failed and skipped ones
    output:
        f"{OUT}/ledger/repository.json",
    params:
        code=PLAN.code("repository"),
        settings=PLAN.settings("repository"),
    log:
        f"{OUT}/logs/repository.log",
    benchmark:
        f"{OUT}/benchmarks/repository.tsv"
    group:
        "report"
    resources:
        runtime=PLAN.runtime("repository"),
        mem_mb=PLAN.mem_mb("repository"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/repository.py $REPOSITORY &> {log}"


# So that the repository itself can be named as a target: snakemake out/demo/demo.zarr
rule store:
    input:
        ancient(f"{OUT}/ledger/repository.json"),
    output:
        directory(f"{OUT}/{PLAN.config.name}.zarr"),


# What a block of a large sweep makes; see docs/cluster.md.
rule hearts:
    input:
        PLAN.records,
    output:
        touch(PLAN.mark),

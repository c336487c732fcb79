"""The repository: table of cases, metadata of its folders, and the checksums of all files."""


rule repository:
    input:
        ancient([] if PLAN.is_published else PLAN.asked_for(GROUPS)),
    output:
        f"{OUT}/SHA256SUMS",
        temp(touch(PLAN.unpublished)),
    log:
        f"{OUT}/logs/repository.log",
    benchmark:
        f"{OUT}/benchmarks/repository.tsv"
    group:
        "report"
    resources:
        **PLAN.resources("repository"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/repository.py" {OUT} &> {{log}}'

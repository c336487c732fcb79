"""The repository: table of cases, metadata of its folders, and the checksums of all files."""


rule repository:
    input:
        hearts=expand(f"{STORE}/hearts/{{heart}}/zarr.json", heart=HEARTS),
        truth=expand(f"{CLIP}/truth/{{size}}/zarr.json", case=CASES, view=VIEWS, size=SIZES),
        bmode=expand(f"{CLIP}/bmode/{{size}}/zarr.json", case=CASES, view=VIEWS, size=SIZES),
        tracking=expand(f"{CLIP}/tracking/{{size}}/zarr.json", case=CASES, view=VIEWS, size=SIZES),
        inference=expand(f"{STORE}/inference/{{case}}/zarr.json", case=CASES) if PLAN.config.inference.tracker else [],
    output:
        f"{OUT}/SHA256SUMS",
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
        f"python $SCRIPTS/repository.py {OUT} &> {{log}}"

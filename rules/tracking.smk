"""Tracking: every tracker on one clip, scored against the truth."""


rule tracking:
    input:
        heart=ancient(PLAN.heart),
        truth=ancient(f"{CLIP}/truth/{{size}}/zarr.json"),
        bmode=ancient(f"{CLIP}/bmode/{{size}}/zarr.json"),
    output:
        f"{CLIP}/tracking/{{size}}/zarr.json",
    log:
        f"{OUT}/logs/tracking/{{case}}/{{view}}/{{size}}.log",
    benchmark:
        f"{OUT}/benchmarks/tracking/{{case}}/{{view}}/{{size}}.tsv"
    group:
        "view"
    priority: 5
    resources:
        **PLAN.resources("tracking"),
    conda:
        "../environment.yml"
    shell:
        f"python $SCRIPTS/tracking.py {OUT} {{wildcards.case}} {{wildcards.view}} {{wildcards.size}} &> {{log}}"

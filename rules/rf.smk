"""The RF of every frame, focused to lines."""


rule rf:
    input:
        heart=ancient(PLAN.heart),
        phantom=ancient(f"{CLIP}/phantom/zarr.json"),
    output:
        f"{CLIP}/rf/zarr.json",
    log:
        f"{OUT}/logs/rf/{{case}}/{{view}}.log",
    benchmark:
        f"{OUT}/benchmarks/rf/{{case}}/{{view}}.tsv"
    group:
        "view"
    priority: 2
    resources:
        **PLAN.resources("rf"),
    conda:
        "../environment.yml"
    shell:
        f"python $SCRIPTS/rf.py {OUT} {{wildcards.case}} {{wildcards.view}} &> {{log}}"

"""The RF of every frame, focused to lines."""


rule rf:
    input:
        ancient(PLAN.needed("rf", HEART, f"{CLIP}/phantom/zarr.json")),
    output:
        f"{CLIP}/rf/zarr.json",
        temp(touch(f"{TOUCHED}/rf/{{case}}/{{view}}")),
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
        f'python "$SCRIPTS/rf.py" {OUT} {{wildcards.case}} {{wildcards.view}} &> {{log}}'

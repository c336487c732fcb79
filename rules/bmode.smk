"""B-mode: the largest clip from the lines (envelope, log compression, scan conversion), smaller ones from it."""


rule bmode:
    input:
        ancient(PLAN.needed("bmode", HEART, f"{CLIP}/rf/zarr.json")),
    output:
        expand(f"{CLIP}/bmode/{{size}}/zarr.json", size=SIZES, allow_missing=True),
        temp(touch(f"{TOUCHED}/bmode/{{case}}/{{view}}")),
    log:
        f"{OUT}/logs/bmode/{{case}}/{{view}}.log",
    benchmark:
        f"{OUT}/benchmarks/bmode/{{case}}/{{view}}.tsv"
    group:
        "view"
    priority: 4
    resources:
        **PLAN.resources("bmode"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/bmode.py" {OUT} {{wildcards.case}} {{wildcards.view}} &> {{log}}'

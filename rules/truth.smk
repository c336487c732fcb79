"""The truth: motion, strain, layer and segment at every pixel of every frame, in all sizes."""


rule truth:
    input:
        ancient(PLAN.needed("truth", HEART)),
    output:
        expand(f"{CLIP}/truth/{{size}}/zarr.json", size=SIZES, allow_missing=True),
        temp(touch(f"{TOUCHED}/truth/{{case}}/{{view}}")),
    log:
        f"{OUT}/logs/truth/{{case}}/{{view}}.log",
    benchmark:
        f"{OUT}/benchmarks/truth/{{case}}/{{view}}.tsv"
    group:
        "view"
    priority: 3
    resources:
        **PLAN.resources("truth"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/truth.py" {OUT} {{wildcards.case}} {{wildcards.view}} &> {{log}}'

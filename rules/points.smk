"""The points that trackers follow: their true motion and strain, and that of the contours of the wall."""


rule points:
    input:
        ancient(PLAN.needed("points", HEART)),
    output:
        f"{CLIP}/points/zarr.json",
        temp(touch(f"{TOUCHED}/points/{{case}}/{{view}}")),
    log:
        f"{OUT}/logs/points/{{case}}/{{view}}.log",
    benchmark:
        f"{OUT}/benchmarks/points/{{case}}/{{view}}.tsv"
    group:
        "view"
    priority: 3
    resources:
        **PLAN.resources("points"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/points.py" {OUT} {{wildcards.case}} {{wildcards.view}} &> {{log}}'

"""The phantom: the imaging plane, and scatterers seeded in the wall and around it."""


rule phantom:
    input:
        ancient(PLAN.needed("phantom", HEART)),
    output:
        f"{CLIP}/phantom/zarr.json",
        temp(touch(f"{TOUCHED}/phantom/{{case}}/{{view}}")),
    log:
        f"{OUT}/logs/phantom/{{case}}/{{view}}.log",
    benchmark:
        f"{OUT}/benchmarks/phantom/{{case}}/{{view}}.tsv"
    group:
        "view"
    priority: 1
    resources:
        **PLAN.resources("phantom"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/phantom.py" {OUT} {{wildcards.case}} {{wildcards.view}} &> {{log}}'

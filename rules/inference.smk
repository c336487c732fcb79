"""What a tracker saw of a heart tells of its muscle: asked for only if `inference.tracker` names a tracker."""


rule inference:
    input:
        heart=ancient(PLAN.heart),
        truth=ancient(expand(f"{CLIP}/truth/{{size}}/zarr.json", view=VIEWS, size=SIZES, allow_missing=True)),
        tracking=ancient(expand(f"{CLIP}/tracking/{{size}}/zarr.json", view=VIEWS, size=SIZES, allow_missing=True)),
    output:
        f"{STORE}/inference/{{case}}/zarr.json",
    log:
        f"{OUT}/logs/inference/{{case}}.log",
    benchmark:
        f"{OUT}/benchmarks/inference/{{case}}.tsv"
    priority: 6
    resources:
        **PLAN.resources("inference"),
    conda:
        "../environment.yml"
    shell:
        f"python $SCRIPTS/inference.py {OUT} {{wildcards.case}} &> {{log}}"

"""What a tracker saw of a heart tells of its muscle: asked for only if `inference.tracker` names a tracker."""

READ = ["points", *expand("truth/{size}", size=SIZES), f"tracking/{PLAN.config.inference.tracker}"]


rule inference:
    input:
        ancient(
            PLAN.needed(
                "inference",
                HEART,
                *expand(f"{CLIP}/{{group}}/zarr.json", view=VIEWS, group=READ, allow_missing=True),
            )
        ),
    output:
        f"{STORE}/inference/{{case}}/zarr.json",
        temp(touch(f"{TOUCHED}/inference/{{case}}")),
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
        f'python "$SCRIPTS/inference.py" {OUT} {{wildcards.case}} &> {{log}}'

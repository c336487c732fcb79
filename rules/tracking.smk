"""Tracking: one tracker on the clips of a view, scored against the truth, in all sizes."""


rule tracking:
    input:
        ancient(
            PLAN.needed(
                "tracking",
                HEART,
                f"{CLIP}/points/zarr.json",
                *expand(f"{CLIP}/{{stage}}/{{size}}/zarr.json", stage=["truth", "bmode"], size=SIZES, allow_missing=True),
            )
        ),
    output:
        f"{CLIP}/tracking/{{tracker}}/zarr.json",
        temp(touch(f"{TOUCHED}/tracking/{{case}}/{{view}}/{{tracker}}")),
    log:
        f"{OUT}/logs/tracking/{{case}}/{{view}}/{{tracker}}.log",
    benchmark:
        f"{OUT}/benchmarks/tracking/{{case}}/{{view}}/{{tracker}}.tsv"
    group:
        "view"
    priority: 5
    resources:
        **PLAN.resources("tracking"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/tracking.py" {OUT} {{wildcards.case}} {{wildcards.view}} {{wildcards.tracker}} &> {{log}}'

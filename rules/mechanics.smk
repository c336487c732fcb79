"""A heart: mesh, fibres, finite-element solution over the beat, kinematics and measures."""


rule mechanics:
    input:
        ancient(PLAN.needed("mechanics")),
    output:
        f"{STORE}/hearts/{{heart}}/zarr.json",
        temp(touch(f"{TOUCHED}/mechanics/{{heart}}")),
    params:
        case=PLAN.case_of,  # any that has this heart
    log:
        f"{OUT}/logs/mechanics/{{heart}}.log",
    benchmark:
        f"{OUT}/benchmarks/mechanics/{{heart}}.tsv"
    group:
        "heart"
    threads: workflow.cores if len(HEARTS) == 1 else 1
    resources:
        **PLAN.resources("mechanics"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/mechanics.py" {OUT} {{params.case}} --threads {{threads}} &> {{log}}'

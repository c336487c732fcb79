"""The truth: motion, strain, layer and segment at every pixel of every frame."""


rule truth:
    input:
        f"{OUT}/ledger/mechanics/{{case}}.json",
    output:
        f"{OUT}/ledger/truth/{{case}}/{{view}}/{{size}}.json",
    params:
        code=PLAN.code("truth"),
        settings=PLAN.settings("truth"),
        excluded=PLAN.excluded,  # why the case is not imaged: its record then says skipped
    log:
        f"{OUT}/logs/truth/{{case}}/{{view}}/{{size}}.log",
    benchmark:
        f"{OUT}/benchmarks/truth/{{case}}/{{view}}/{{size}}.tsv"
    group:
        "view"
    priority: 3
    resources:
        runtime=PLAN.runtime("truth"),
        mem_mb=PLAN.mem_mb("truth"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/truth.py $REPOSITORY {wildcards.case} {wildcards.view} {wildcards.size} --code {params.code} &> {log}"

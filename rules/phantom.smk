"""The phantom: the imaging plane, and scatterers seeded in the wall and around it."""


rule phantom:
    input:
        f"{OUT}/ledger/mechanics/{{case}}.json",
    output:
        f"{OUT}/ledger/phantom/{{case}}/{{view}}.json",
        scatterers=temp(f"{OUT}/scratch/{{case}}/{{view}}/scatterers.npz"),
    params:
        code=PLAN.code("phantom"),
        settings=PLAN.settings("phantom"),
        excluded=PLAN.excluded,  # why the case is not imaged: its record then says skipped
    log:
        f"{OUT}/logs/phantom/{{case}}/{{view}}.log",
    benchmark:
        f"{OUT}/benchmarks/phantom/{{case}}/{{view}}.tsv"
    group:
        "view"
    priority: 1
    resources:
        runtime=PLAN.runtime("phantom"),
        mem_mb=PLAN.mem_mb("phantom"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/phantom.py $REPOSITORY {wildcards.case} {wildcards.view} --code {params.code} &> {log}"

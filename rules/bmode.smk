"""B-mode: the largest clip from the lines (envelope, log compression, scan conversion), smaller ones from the largest.

The lines are in the store if the configuration keeps them (`rf.keep`), else in the file that rf passes on.
"""


rule bmode:
    input:
        PLAN.bmode_source,  # record of rf, and lines.npz unless rf.keep has lines; for smaller clips, record of the largest
    output:
        f"{OUT}/ledger/bmode/{{case}}/{{view}}/{{size}}.json",
    params:
        code=PLAN.code("bmode"),
        settings=PLAN.settings("bmode"),
    log:
        f"{OUT}/logs/bmode/{{case}}/{{view}}/{{size}}.log",
    benchmark:
        f"{OUT}/benchmarks/bmode/{{case}}/{{view}}/{{size}}.tsv"
    group:
        "view"
    priority: 4
    resources:
        runtime=PLAN.runtime("bmode"),
        mem_mb=PLAN.mem_mb("bmode"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/bmode.py $REPOSITORY {wildcards.case} {wildcards.view} {wildcards.size} --code {params.code} &> {log}"

"""The RF of every frame, focused to lines.

The script also reads the heart from the store. It is there: phantom, whose record is the input, needs it too.
"""


rule rf:
    input:
        rules.phantom.output,
    output:
        f"{OUT}/ledger/rf/{{case}}/{{view}}.json",
        lines=temp(f"{OUT}/scratch/{{case}}/{{view}}/lines.npz"),
    params:
        code=PLAN.code("rf"),
        settings=PLAN.settings("rf"),
    log:
        f"{OUT}/logs/rf/{{case}}/{{view}}.log",
    benchmark:
        f"{OUT}/benchmarks/rf/{{case}}/{{view}}.tsv"
    group:
        "view"
    priority: 2
    threads: 1
    resources:
        runtime=PLAN.runtime("rf"),
        mem_mb=PLAN.mem_mb("rf"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/rf.py $REPOSITORY {wildcards.case} {wildcards.view} --code {params.code} --threads {threads} &> {log}"

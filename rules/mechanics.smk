"""The heart of a case: mesh, fibres, finite-element solution over the beat, kinematics and measures.

Of cases that share one heart (the same motion) only the first is solved; the others take over its files.
"""


rule mechanics:
    input:
        PLAN.same_motion,  # record of the case whose motion is taken over, if there is one
    output:
        f"{OUT}/ledger/mechanics/{{case}}.json",
    params:
        code=PLAN.code("mechanics"),
        settings=PLAN.settings("mechanics"),
    log:
        f"{OUT}/logs/mechanics/{{case}}.log",
    benchmark:
        f"{OUT}/benchmarks/mechanics/{{case}}.tsv"
    group:
        "heart"
    threads: workflow.cores if len(PLAN.cases) == 1 else 1
    resources:
        runtime=PLAN.runtime("mechanics"),
        mem_mb=PLAN.mem_mb("mechanics"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/mechanics.py $REPOSITORY {wildcards.case} --same-as {input} --code {params.code} "
        "--threads {threads} &> {log}"

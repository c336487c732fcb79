"""What a tracker saw of a heart tells of its muscle: asked for only if `inference.tracker` names a tracker.

The script also reads the heart and its truth from the store. They are there: tracking, whose records are the input,
needs them too.
"""


rule inference:
    input:
        PLAN.tracked,  # of all views, in the images from which is inferred
    output:
        f"{OUT}/ledger/inference/{{case}}.json",
    params:
        code=PLAN.code("inference"),
        settings=PLAN.settings("inference"),
    log:
        f"{OUT}/logs/inference/{{case}}.log",
    benchmark:
        f"{OUT}/benchmarks/inference/{{case}}.tsv"
    priority: 6
    threads: 1
    resources:
        runtime=PLAN.runtime("inference"),
        mem_mb=PLAN.mem_mb("inference"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/inference.py $REPOSITORY {wildcards.case} --code {params.code} --threads {threads} &> {log}"

"""Tracking: every tracker on one clip, scored against the truth.

The record of an earlier run is updated, not deleted: what a tracker found in the same clip stays. The script also reads
the heart from the store. It is there: truth, whose record is an input, needs it too.
"""


rule tracking:
    input:
        rules.bmode.output,
        rules.truth.output,
    output:
        update(f"{OUT}/ledger/tracking/{{case}}/{{view}}/{{size}}.json"),
    params:
        code=PLAN.code("tracking"),
        settings=PLAN.settings("tracking"),
    log:
        f"{OUT}/logs/tracking/{{case}}/{{view}}/{{size}}.log",
    benchmark:
        f"{OUT}/benchmarks/tracking/{{case}}/{{view}}/{{size}}.tsv"
    group:
        "view"
    priority: 5
    threads: 1
    resources:
        runtime=PLAN.runtime("tracking"),
        mem_mb=PLAN.mem_mb("tracking"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/tracking.py $REPOSITORY {wildcards.case} {wildcards.view} {wildcards.size} --code {params.code} "
        "--threads {threads} &> {log}"

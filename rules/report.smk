"""The report: figures of the repository, and the page that shows them."""

FIGURES = ["loop", "strain", "physiology", "population", "curves", "segments", "bullseye", "error", "leaderboard"]
FIGURES += ["heart", "resolutions", "views"]

TABLES = []
if PLAN.config.inference.tracker:
    FIGURES += ["inference", "posterior"]
    TABLES += [f"{OUT}/inference.csv"]


rule report:
    input:
        rules.repository.output,
        PLAN.external_scores,
    output:
        report(expand(f"{OUT}/figures/{{name}}.png", name=FIGURES), category="figures"),
        expand(f"{OUT}/figures/{{name}}.svg", name=FIGURES),
        report(f"{OUT}/figures/clip.gif", category="clip"),
        f"{OUT}/figures/clip.mp4",
        f"{OUT}/figures/leaderboard.csv",
        *TABLES,
        f"{OUT}/report.html",
    params:
        code=PLAN.code("report"),
    log:
        f"{OUT}/logs/report.log",
    benchmark:
        f"{OUT}/benchmarks/report.tsv"
    group:
        "report"
    resources:
        runtime=PLAN.runtime("report"),
        mem_mb=PLAN.mem_mb("report"),
    conda:
        "../environment.yml"
    shell:
        "python $SCRIPTS/report.py $REPOSITORY &> {log}"

"""The report: figures of the repository, and the page that shows them."""

FIGURES = ["loop", "strain", "physiology", "leaderboard", "heart"]
FIGURES += [] if PLAN.config.has_volumes else ["curves", "segments", "bullseye", "error", "views"]
FIGURES += ["population"] if len(PLAN.cases) > 1 else []
FIGURES += ["inference"] if PLAN.config.inference.tracker else []


rule report:
    input:
        ancient(PLAN.unpublished),
    output:
        report(expand(f"{OUT}/figures/{{name}}.png", name=FIGURES), category="figures"),
        expand(f"{OUT}/figures/{{name}}.svg", name=FIGURES),
        report(f"{OUT}/figures/clip.mp4", category="clip"),
        f"{OUT}/figures/leaderboard.csv",
        f"{OUT}/inference.csv" if PLAN.config.inference.tracker else [],
        f"{OUT}/report.html",
        temp(touch(PLAN.unreported)),
    log:
        f"{OUT}/logs/report.log",
    benchmark:
        f"{OUT}/benchmarks/report.tsv"
    group:
        "report"
    threads: 2
    resources:
        **PLAN.resources("report"),
    conda:
        "../environment.yml"
    shell:
        f'python "$SCRIPTS/report.py" {OUT} --threads {{threads}} &> {{log}}'

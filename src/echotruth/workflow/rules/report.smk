"""Figures of a repository, and the page that shows them."""

FIGURES = FOLDER / "figures"


def figures(*names):
    """Figures for readers and, as SVG, for the page."""
    return [FIGURES / f"{name}.{kind}" for name in names for kind in ("png", "svg")]


rule report:
    input:
        rules.repository.output,
        external=sorted(FOLDER.glob("external/*.csv")),
    output:
        figures("loop", "strain", "physiology", "population"),
        figures("curves", "segments", "bullseye", "error", "leaderboard"),
        standings=FIGURES / "leaderboard.csv",
    params:
        code=code("report"),
    log:
        FOLDER / "logs/report.log",
    group:
        "report"
    resources:
        runtime=15,
        mem_mb=lambda wildcards, attempt: attempt * 2000,
    shell:
        "{{ {COMPILE[report]}; {RUN}/report.py {FOLDER} motion; }} &> {log}"


rule report_images:
    input:
        rules.repository.output,
    output:
        figures("heart", "resolutions", "views"),
        clip=FIGURES / "clip.gif",
        movie=FIGURES / "clip.mp4",
    params:
        code=code("report"),
    log:
        FOLDER / "logs/report_images.log",
    group:
        "report"
    resources:
        runtime=15,
        mem_mb=lambda wildcards, attempt: attempt * 2000,
    shell:
        "{{ {COMPILE[report]}; {RUN}/report.py {FOLDER} images; }} &> {log}"


rule report_page:
    input:
        rules.report.output,
        rules.report_images.output,
    output:
        FOLDER / "report.html",
    params:
        code=code("report"),
    log:
        FOLDER / "logs/report_page.log",
    group:
        "report"
    resources:
        runtime=15,
        mem_mb=lambda wildcards, attempt: attempt * 2000,
    shell:
        "{{ {COMPILE[report]}; {RUN}/report.py {FOLDER} page; }} &> {log}"

"""Figures of a repository, for the page that `snakemake --report` writes."""

FIGURES = FOLDER / "figures"
CAPTIONS = WORKFLOW / "captions"


def figure(name, category, title):
    """Figure with its caption, the file of the same name in captions."""
    caption = CAPTIONS / f"{Path(name).stem}.rst"
    return report(FIGURES / name, caption=str(caption), category=category, labels={"figure": title})


rule report:
    input:
        rules.repository.output,
        external=sorted(FOLDER.glob("external/*.csv")),
    output:
        heart=figure("heart.png", "1 Heart", "Heart at ED and ES"),
        loop=figure("loop.png", "1 Heart", "Pressure-volume loop and active tension"),
        strain=figure("strain.png", "1 Heart", "Strain over the cycle"),
        physiology=figure("physiology.png", "1 Heart", "Motion over the cycle beside measured hearts"),
        bullseye=figure("bullseye.png", "3 Tracking", "Bullseye, FE and tracked"),
        error=figure("error.png", "3 Tracking", "Error by layer and resolution"),
        leaderboard=figure("leaderboard.png", "3 Tracking", "Leaderboard"),
        standings=figure("leaderboard.csv", "3 Tracking", "Leaderboard as a table"),
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
        clip=figure("clip.gif", "2 Images", "Clip with its true motion"),
        resolutions=figure("resolutions.png", "2 Images", "Three resolutions"),
        views=figure("views.png", "2 Images", "All views at ED and ES"),
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

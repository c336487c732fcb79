"""The figures and the page of a repository, made as the workflow makes them."""

from pathlib import Path

from echotruth.config.loading import load
from echotruth.report import page
from echotruth.report.figures import PARTS, Figures


def report(folder: Path) -> str:
    """Draw the figures of a repository and write its page; the text of the page."""
    config = load(folder / "config.yaml")
    for part in PARTS:
        Figures(folder / f"{config.name}.zarr", config, folder / "figures").draw(part)
    return page.write(folder, config).read_text(encoding="utf-8")

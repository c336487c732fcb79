"""The figures and the page of a repository, made as the workflow makes them."""

from pathlib import Path

from echotruth.report import page
from echotruth.report.figures import Figures
from echotruth.repository.reader import Repository


def report(folder: Path) -> str:
    """Draw the figures of a repository and write its page; the text of the page."""
    repository = Repository(folder)
    Figures(repository, folder / "figures").draw()
    return page.write(repository).read_text(encoding="utf-8")

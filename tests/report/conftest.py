"""A repository with its figures and its page."""

import pytest
from known_repository import SIZES
from reported_repository import report
from shown_repository import Shown, shown_repository


@pytest.fixture(scope="session")
def reported(tmp_path_factory) -> Shown:
    """A ring that moves by whole pixels, with its report."""
    shown = shown_repository(tmp_path_factory.mktemp("reported") / "known")
    report(shown.folder)
    return shown


@pytest.fixture(scope="session")
def text(reported) -> str:
    return (reported.folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture
def size() -> int:
    """Of the largest images, px."""
    return SIZES[0]

"""A repository with its figures and its page."""

from dataclasses import replace
from shutil import copytree

import pytest
from known_repository import SIZES
from once import once
from reported_repository import report
from shown_repository import Shown


@pytest.fixture(scope="session")
def reported(shown, tmp_path_factory) -> Shown:
    """The repository `shown` with its report."""
    folder = once(tmp_path_factory, "reported", lambda to: report(copytree(shown.folder, to / "known")))
    return replace(shown, folder=folder / "known")


@pytest.fixture(scope="session")
def text(reported) -> str:
    return (reported.folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture
def size() -> int:
    """Of the largest images, px."""
    return SIZES[0]

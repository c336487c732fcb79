"""A repository with its figures and its page, and a browser."""

from pathlib import Path

import pytest
from known_repository import SIZES
from reported_repository import report
from shown_repository import Shown, shown_repository

CHROMIUM = Path("/usr/bin/chromium")
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking")


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


@pytest.fixture(scope="session")
def browser():
    api = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    if not CHROMIUM.is_file():
        pytest.skip(f"needs {CHROMIUM}")
    with api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        yield opened
        opened.close()

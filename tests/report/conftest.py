"""The page of a repository."""

import pytest
from known_repository import SIZES


@pytest.fixture(scope="session")
def text(reported) -> str:
    return (reported.folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture
def size() -> int:
    """Of the largest images, px."""
    return SIZES[0]

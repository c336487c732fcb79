"""Generated pages are up to date."""

from pathlib import Path

import pytest

from docs.reference import files

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("name", ["config/schema.json", "config/README.md", "docs/schema.md"])
def test_page_on_disk_is_the_generated_one(name):
    assert files()[name] == (ROOT / name).read_text(encoding="utf-8"), "run make reference"


def test_every_generated_page_is_tested():
    assert set(files()) == {"config/schema.json", "config/README.md", "docs/schema.md"}

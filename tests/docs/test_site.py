"""The site: it builds without a warning, and its links lead somewhere; test_notebooks.py runs the notebooks."""

import os
import re
import shutil
import subprocess
import sys
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import echotruth as et
from echotruth.cli import parser

for package in ("sphinx", "myst_nb", "furo", "numpydoc", "sphinx_copybutton", "sphinx_design"):
    pytest.importorskip(package, reason="the site needs the extra docs")

ROOT = Path(__file__).parents[2]
MADE = shutil.ignore_patterns("out", ".snakemake", "__pycache__", ".cache")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder of the site, built from a copy of the pages, with notebooks as they are kept."""
    source = tmp_path_factory.mktemp("site")
    for name in ("docs", "config", "benchmarks", "examples"):
        shutil.copytree(ROOT / name, source / name, ignore=MADE)
    for page in [*ROOT.glob("*.md"), ROOT / "CITATION.cff"]:
        shutil.copy(page, source)
    options = ["-W", "--keep-going", "-b", "html", "-c", "docs", "-D", "nb_execution_mode=off"]
    command = [sys.executable, "-m", "sphinx", *options, ".", "built"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(
        command, cwd=source, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    assert done.returncode == 0, done.stdout[-5000:]
    return source / "built"


def test_every_link_within_the_site_leads_to_a_file(site):
    broken = []
    for page in site.rglob("*.html"):
        for target in re.findall(r'(?:href|src)="([^"]+)"', page.read_text()):
            parts = urlsplit(unescape(target))
            if parts.scheme or parts.netloc or not parts.path:
                continue
            if not (page.parent / unquote(parts.path)).exists():
                broken.append((page.name, target))
    assert not broken


def test_page_of_the_command_line_has_every_command(site):
    page = (site / "docs/commands.html").read_text()
    (choices,) = [action.choices for action in parser()._actions if isinstance(action.choices, dict)]
    assert all(f'id="echotruth-{name}"' in page for name in choices)


def test_reference_describes_every_public_name(site):
    pages = "".join(page.read_text() for page in (site / "docs/library").glob("*.html"))
    names = [f"echotruth.{name}" for name in et.__all__ if name != "learning"]
    names += [f"echotruth.learning.{name}" for name in et.learning.__all__]
    assert [name for name in names if f'id="{name}"' not in pages] == []


def test_root_of_the_site_leads_to_its_first_page(site):
    assert 'url=docs/index.html"' in (site / "index.html").read_text()
    assert (site / "docs/index.html").exists()

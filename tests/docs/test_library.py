"""The library reference: every public name is on a page and has an example, and the examples run as they stand."""

import doctest
import re
from pathlib import Path

import learning_repository
import pytest
from finished_repository import configured

import echotruth as et
from echotruth.config import Bmode, Geometry, Rf, Tracking, View

PAGES = Path(__file__).parents[2] / "docs/library"
CONFIGURATIONS = {"Config", "Probe", "Rf", "View"}
"""Sections of a configuration, whose keys are in its own reference."""
NO_EXAMPLE = {"Item", "ConfigError", "EchoError", "TrackerFailed"}
PUBLIC = {name: getattr(et, name) for name in et.__all__ if name not in ("learning", *CONFIGURATIONS, *NO_EXAMPLE)}
PUBLIC |= {f"learning.{name}": getattr(et.learning, name) for name in et.learning.__all__ if name not in NO_EXAMPLE}


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """Folder in which `out/demo` is a repository like that of config/demo.yaml, made in seconds."""
    folder = tmp_path_factory.mktemp("library")
    planes = {
        "base": View(position=0.2),
        "mid": View(),
        "apex": View(position=0.8),
        "long_axis": View(plane="long_axis"),
    }
    config = configured(
        name="demo",
        views=("mid",),
        cases={},
        bmode=Bmode(size_px=128, downsampling=(1,)),
        rf=Rf(lines=24, focal_zones=1),
        tracking=Tracking(grid_px=4, trackers={"dis": {"method": "dis"}, "bspline_dic": {"method": "bspline_dic"}}),
        geometry=Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1),
    ).model_copy(update={"views": planes})
    learning_repository.make(folder / "out/demo", config)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLIC)
def test_examples_of_the_library_run_and_give_what_they_say(name, demo, monkeypatch):
    monkeypatch.chdir(demo)
    (found,) = doctest.DocTestFinder(recurse=False).find(PUBLIC[name], name, globs={})
    assert any(doctest.SKIP not in example.options for example in found.examples)
    assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(found).failed == 0


def test_every_public_name_is_on_a_page_of_the_reference():
    text = "".join(page.read_text() for page in PAGES.glob("*.md"))
    shown = set(re.findall(r"(?:auto(?:function|class|exception)|py:data):: (\w+)", text))
    assert {*et.__all__, *et.learning.__all__} - {"learning"} <= shown

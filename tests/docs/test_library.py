"""The library reference: every public name is on a page and has an example, and the examples run as they stand."""

import doctest
import re
from pathlib import Path

import pytest

import echotruth as et

PAGES = Path(__file__).parents[2] / "docs/library"
CONFIGURATIONS = {"Config", "Probe", "Rf", "View"}
"""Sections of a configuration, whose keys are in its own reference."""
NO_EXAMPLE = {"Item", "ConfigError", "EchoError", "TrackerFailed"}
PUBLIC = {name: getattr(et, name) for name in et.__all__ if name not in ("learning", *CONFIGURATIONS, *NO_EXAMPLE)}
PUBLIC |= {f"learning.{name}": getattr(et.learning, name) for name in et.learning.__all__ if name not in NO_EXAMPLE}


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

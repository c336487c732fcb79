"""What is given of a repository is checked, and a missing package told, before anything is described."""

import sys

import pytest

from echotruth.repository.description import DescriptionError, attribution, describe


def plain(**changes):
    return attribution(**{"authors": [], "licence": None, "url": None, "release": "1.0.0", "day": None} | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"authors": ["Doe,"]}, "has no name: give 'Family, Given'"),
        ({"authors": ["Doe, Jane; 0000-0002-1825-0098"]}, "is no ORCID iD, its last digit does not fit"),
        ({"authors": ["Doe, Jane; A; B"]}, "gives two of affiliation"),
        ({"authors": ["Group; University"]}, "a group has neither ORCID iD nor affiliation"),
        ({"licence": "free"}, "is no known licence: give one identifier"),
        ({"licence": "MIT OR Apache-2.0"}, "is no known licence"),
        ({"url": "example.org"}, "is no address"),
        ({"release": "1"}, "is no version: give three numbers"),
        ({"day": "yesterday"}, "is no date: give year, month and day"),
    ],
)
def test_bad_attribution_is_one_sentence(changes, message):
    with pytest.raises(DescriptionError, match=message) as told:
        plain(**changes)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(("package", "module"), [("mlcroissant", "croissant"), ("rocrate", "ro_crate")])
def test_missing_package_is_told_in_one_sentence_with_the_extra(tmp_path, monkeypatch, package, module):
    monkeypatch.setitem(sys.modules, package, None)
    for name in [
        name for name in sys.modules if name.startswith(f"{package}.") or name.endswith(f"description.{module}")
    ]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(DescriptionError, match=r"pip install 'echotruth\[description\]'$") as told:
        describe(tmp_path)
    assert "\n" not in str(told.value) and not list(tmp_path.iterdir())

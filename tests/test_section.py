"""Sections know what their keys mean."""

from echotruth.config import Geometry
from echotruth.section import Section, docstrings


class Base(Section):
    """A section."""

    shared: int = 1
    """Said in
    the base."""


class Derived(Base):
    """A section with more keys."""

    own: int = 2
    """Said here."""
    silent: int = 3


def test_keys_mean_what_their_docstrings_say_in_bases_too():
    assert docstrings(Derived) == {"shared": "Said in\nthe base.", "own": "Said here."}


def test_json_schema_says_what_every_key_means_that_has_a_docstring():
    properties = Derived.model_json_schema()["properties"]
    assert [properties[key].get("description") for key in properties] == ["Said in\nthe base.", "Said here.", None]
    assert all("description" in options for options in Geometry.model_json_schema()["properties"].values())

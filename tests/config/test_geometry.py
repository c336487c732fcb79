"""Section `geometry`: defaults from the preset, keys of a file, and sweeps."""

import pytest

from echotruth.cases import expand
from echotruth.config import Config, Geometry
from echotruth.config.anatomy import HEART_PRESETS
from echotruth.config.loading import ConfigError, validate


@pytest.mark.parametrize("species", HEART_PRESETS)
def test_resolved_geometry_has_the_lengths_of_its_preset(species):
    resolved = Geometry(preset=species).resolved()
    assert {key: getattr(resolved, key) for key in HEART_PRESETS[species]} == HEART_PRESETS[species]
    assert resolved.resolved() == resolved


def test_wall_from_a_file_has_no_lengths_of_an_ellipsoid():
    assert Geometry(file="heart.vtu").resolved().wall_mm is None


def test_preset_is_swept():
    cases = expand(Config(cases={"geometry.preset": ["mouse", "rat"]}))
    radii = [case.config.geometry.resolved().endo_radius_mm for case in cases]
    assert radii == [HEART_PRESETS[species]["endo_radius_mm"] for species in ("mouse", "rat")]


@pytest.mark.parametrize("key", ["wall_mm", "endo_length_mm", "elongation", "scale", "hypertrophy", "dilation"])
def test_length_or_factor_is_swept(key):
    values = [0.8, 1.0, 1.3] if key != "endo_length_mm" else [4.0, 5.0]
    cases = expand(Config(cases={f"geometry.{key}": values}))
    assert [getattr(case.config.geometry.resolved(), key) for case in cases] == values


def test_keys_of_a_file_are_read_from_yaml_as_they_stand():
    geometry = {
        "file": "heart.vtu",
        "wall_cells": {"array": "_volume-id", "values": [1, 7]},
        "surface_labels": {"array": "side", "endo": [1], "base": ["lid"]},
        "septum_point": [1.0, 2, 3.5],
    }
    found = validate({"geometry": geometry}, "a.yaml").geometry
    assert found.wall_cells.values == [1, 7] and found.surface_labels.epi == [] and found.septum_point == [1, 2, 3.5]


def test_combination_that_makes_no_ellipsoid_is_refused():
    with pytest.raises(ConfigError, match=r"geometry\.base_mm = 1\.4: must lie within \+-endo_length_mm = 1\.2"):
        expand(Config(cases={"geometry.endo_length_mm": [5.4, 1.2]}))

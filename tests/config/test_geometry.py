"""Section `geometry`: defaults from the preset, keys of a file, and sweeps."""

import pytest

from echotruth.cases import expand
from echotruth.config import Config, Geometry
from echotruth.config.loading import ConfigError, validate


def test_wall_from_a_file_has_no_lengths_of_an_ellipsoid():
    assert Geometry(file="heart.vtu").resolved().wall_mm is None


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

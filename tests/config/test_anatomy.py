"""Presets of the heart against published volumes."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.config.anatomy import HEART_PRESETS


def cap(radius, length, base):
    """Volume of an ellipsoid of revolution below a plane `base` above its centre."""
    return np.pi * radius**2 * (base + length - (base**3 + length**3) / (3 * length**2))


VOLUMES = {
    "mouse": (32.8, 71),
    "rat": (230 * (0.6 - 0.006 * 4), 435 / 1.05),
    "human": (150e3 * (0.6 - 0.006 * 7), 150e3 * (64.7 / 82.3 + 52.0 / 77.7) / 2 / 1.05),
}
"""Volumes of cavity and wall, uL, from the sources that the module names."""


@pytest.mark.parametrize("species", HEART_PRESETS)
def test_cavity_and_wall_have_the_published_volumes(species):
    size = Geometry(preset=species).lengths()
    radius, length, base = (size[key] for key in ("endo_radius_mm", "endo_length_mm", "base_mm"))
    cavity = cap(radius, length, base)
    wall = cap(radius + size["wall_mm"], length + size["apex_wall_mm"], base) - cavity
    assert (cavity, wall) == pytest.approx(VOLUMES[species], rel=5e-3)


def test_apical_wall_keeps_its_proportion():
    assert Geometry(wall_mm=2.18).lengths()["apex_wall_mm"] == pytest.approx(0.48)
    assert Geometry(wall_mm=0.7, apex_wall_mm=0.3).lengths()["apex_wall_mm"] == 0.3

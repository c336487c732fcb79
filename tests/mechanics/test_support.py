"""Supports of the heart against integrals known by hand."""

import numpy as np
import pytest

from echotruth.config import Config, Geometry, Loop, Mechanics
from echotruth.mechanics.beat import beat
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.support import base_support, spring_stiffness

HEMISPHERE = Geometry(
    endo_radius_mm=2.0,
    endo_length_mm=2.0,
    wall_mm=1.0,
    apex_wall_mm=1.0,
    base_mm=0.0,
    circumferential_elements=24,
    longitudinal_elements=8,
    transmural_elements=1,
)
RADIUS, STIFFNESS = 3e-3, 1e6


def test_springs_push_back_by_the_normal_part_of_a_shift():
    """Over half a sphere the mean square of any component of the normal is a third: force = k 2 pi R^2 / 3."""
    mesh = left_ventricle(HEMISPHERE)
    matrix = spring_stiffness(mesh, STIFFNESS)
    np.testing.assert_allclose(matrix, matrix.transpose(0, 2, 1), atol=1e-12)
    for axis in range(3):
        shift = np.tile(np.eye(3)[axis], 6)
        force = np.einsum("frs,r,s->", matrix, shift, shift)
        assert force == pytest.approx(STIFFNESS * 2 * np.pi * RADIUS**2 / 3, rel=1e-3)


def test_base_moves_along_its_radius_alone_or_not_at_all():
    mesh = left_ventricle(HEMISPHERE)
    rim = np.unique(mesh.base)
    free, fixed = (base_support(mesh, base) for base in ("radial_free", "fixed"))
    assert free.free.sum() == fixed.free.sum() + len(rim)
    np.testing.assert_allclose(np.cross(free.directions[rim, 0], mesh.nodes[rim]), 0, atol=1e-12)
    assert free.free[rim].tolist() == [[True, False, False]] * len(rim)


def test_surroundings_keep_the_epicardium_from_growing():
    coarse = Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1)

    def filled(spring):
        wall = Mechanics(material={"stiffness_kPa": 1.1}, epicardial_spring_kPa_per_mm=spring)
        return beat(Config(geometry=coarse, loop=Loop(frames=2), mechanics=wall))["mechanics"]["volume"][0]

    assert filled(10.0) < 0.9 * filled(0.0)

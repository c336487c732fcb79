"""Numbering and numbers of the elements that are laid through a wall."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.mechanics.geometry.template import ellipse_angle, mesh_wall


def tube(depth, r, azimuth):
    """A cup between the radii 1 and 2."""
    radius = (1 + depth) * r
    return np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), (1 + depth) * (r**2 - 1)])


@pytest.mark.parametrize("around", [6, 12, 18, 36])
def test_numbers_of_elements_are_as_asked(around):
    geometry = Geometry(circumferential_elements=around, longitudinal_elements=8, transmural_elements=2)
    mesh = mesh_wall(tube, geometry)
    assert len(mesh.base) == 2 * 2 * around
    assert np.unique(mesh.cells).size == len(mesh.nodes)


def test_all_walls_share_one_numbering():
    geometry = Geometry(circumferential_elements=12, longitudinal_elements=4, transmural_elements=1)
    first = mesh_wall(tube, geometry)
    second = mesh_wall(lambda *at: 2 * tube(*at), geometry)
    for name in ("cells", "endo", "epi", "base"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_ellipse_angle_runs_from_the_apex_to_the_base():
    angle = ellipse_angle(np.linspace(0, 1, 50), 1.0, 3.0, 1.0)
    assert angle[0] == 0 and angle[-1] == pytest.approx(np.arccos(-1 / 3))
    assert np.all(np.diff(angle) > 0)

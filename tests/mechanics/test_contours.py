"""Lengths and thickness of walls whose shape is known."""

import numpy as np
import pytest
from scipy.special import ellipe

from echotruth.config import Geometry
from echotruth.mechanics.contours import (
    MID_WALL,
    cut_triangles,
    depth_surface,
    global_longitudinal_strain,
    wall_thickness,
)
from echotruth.mechanics.fibres import wall_depth
from echotruth.mechanics.geometry import left_ventricle


@pytest.fixture(scope="module")
def hemisphere():
    """A hemisphere of radii 2 and 3 mm."""
    lengths = {"endo_radius_mm": 2.0, "endo_length_mm": 2.0, "wall_mm": 1.0, "apex_wall_mm": 1.0, "base_mm": 0.0}
    return left_ventricle(Geometry(**lengths, longitudinal_elements=10, transmural_elements=2))


@pytest.fixture(scope="module")
def tube():
    return left_ventricle(Geometry(shape="tube", longitudinal_elements=4, transmural_elements=2))


def test_mid_wall_of_a_hemisphere_has_the_mean_radius(hemisphere):
    corners = depth_surface(wall_depth(hemisphere), hemisphere.cells, MID_WALL).values(hemisphere.nodes)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=-1), 2.5e-3, rtol=0.01)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(normal, axis=-1).sum() / 2 == pytest.approx(2 * np.pi * 2.5e-3**2, rel=0.01)


@pytest.mark.parametrize(("wide", "long"), [(1.0, 0.8), (0.7, 0.85), (1.1, 1.2)])
def test_gls_of_a_hemisphere_that_becomes_half_an_ellipsoid(hemisphere, wide, long):
    """Half the circumference of an ellipse is 2 a E(m), with the larger half-axis a."""
    larger, smaller = max(wide, long), min(wide, long)
    expected = 2 * larger * ellipe(1 - (smaller / larger) ** 2) / np.pi - 1
    ed = hemisphere.nodes
    found = global_longitudinal_strain(wall_depth(hemisphere), hemisphere.cells, ed, ed * [wide, wide, long])
    assert found == pytest.approx(expected, abs=1e-3)


def test_gls_of_a_tube_is_its_shortening_whatever_its_width(tube):
    found = global_longitudinal_strain(wall_depth(tube), tube.cells, tube.nodes, tube.nodes * [0.7, 0.7, 0.83])
    assert found == pytest.approx(-0.17, abs=1e-6)


def test_gls_of_a_scaled_heart_that_turns_and_moves_is_the_scale(coarse_mesh, affine):
    turn = affine[0] @ np.diag([1 / 0.85, 1 / 0.85, 1 / 0.93])
    moved = 0.8 * coarse_mesh.nodes @ turn.T + [1e-3, -2e-3, 0.5e-3]
    found = global_longitudinal_strain(wall_depth(coarse_mesh), coarse_mesh.cells, coarse_mesh.nodes, moved)
    assert found == pytest.approx(-0.2, abs=1e-12)


def test_wall_thickness_of_a_tube_is_that_of_its_polygon(tube):
    """The polygon of n chords, through quadratic nodes, has the area of its circle times sin(2 pi / n) / (2 pi / n)."""
    radii = [np.hypot(*tube.nodes[side, :2].T).max() for side in (tube.endo, tube.epi)]
    turn = 2 * np.pi / 48
    height = 0.37 * tube.nodes[:, 2].min()
    expected = (radii[1] - radii[0]) * np.sqrt(np.sin(turn) / turn)
    assert wall_thickness(tube.endo, tube.epi, tube.nodes, height) == pytest.approx(expected, rel=1e-3)


def test_thickening_of_an_affine_motion_is_that_of_the_root_of_its_area(tube, affine):
    matrix, shift = affine
    height = 0.5 * tube.nodes[:, 2].min()
    before, after = (
        wall_thickness(tube.endo, tube.epi, at, height) for at in (tube.nodes, tube.nodes @ matrix.T + shift)
    )
    assert after / before == pytest.approx(0.85, rel=1e-6)


def test_a_plane_beyond_the_wall_has_no_thickness(tube):
    assert np.isnan(wall_thickness(tube.endo, tube.epi, tube.nodes, 1.0))


def test_a_cut_through_corners_is_counted_once():
    """The unit square, as two triangles, cut along its diagonal, along a side and across."""
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    for value, length in (
        (corners[:, 0] - corners[:, 1], np.sqrt(2)),
        (corners[:, 0] - 1, 1),
        (corners[:, 0] - 0.25, 1),
    ):
        ends = cut_triangles(triangles, value).values(corners)
        assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1).sum() == pytest.approx(length)

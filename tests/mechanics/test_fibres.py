"""Wall depth and fibre angles, read back."""

import numpy as np
import pytest

from echotruth.config import Fibres, Geometry
from echotruth.mechanics import fibres
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.quadrature import tetrahedron
from echotruth.tetrahedra import shape

COARSE = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 2}
VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.98 + 0.005


@pytest.fixture(scope="module")
def wall():
    mesh = left_ventricle(Geometry(**COARSE))
    return mesh, fibres.wall_depth(mesh)


def test_depth_is_the_share_of_the_radius_in_a_hemisphere():
    sphere = Geometry(
        endo_radius_mm=2.0, endo_length_mm=2.0, epi_radius_mm=4.0, epi_length_mm=4.0, base_mm=0.0, **COARSE
    )
    mesh = left_ventricle(sphere)
    radius = np.linalg.norm(mesh.nodes, axis=1)
    np.testing.assert_allclose(fibres.wall_depth(mesh), (radius - 2e-3) / 2e-3, atol=0.02)


def test_depth_is_exact_on_both_sides(wall):
    mesh, depth = wall
    assert np.all(depth[mesh.endo] == 0)
    assert np.all(depth[mesh.epi] == 1)
    assert 0 <= depth.min() <= depth.max() <= 1


def test_axes_are_orthonormal_right_handed_and_point_as_named(wall):
    mesh, depth = wall
    xi, _ = tetrahedron()
    axes = fibres.wall_axes(mesh, depth, xi)
    np.testing.assert_allclose(axes @ axes.swapaxes(-1, -2), np.broadcast_to(np.eye(3), axes.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(axes), 1)
    x, y, _ = np.moveaxis(np.einsum("qa,cai->cqi", shape(xi), mesh.nodes[mesh.cells]), -1, 0)
    radial, circumferential, longitudinal = np.moveaxis(axes, -2, 0)
    assert np.all(radial[..., 0] * x + radial[..., 1] * y > 0)
    assert np.all(circumferential[..., 1] * x - circumferential[..., 0] * y > 0)
    assert np.all(longitudinal[..., 2] > 0)


def test_fibre_frame_is_right_handed_with_the_normal_along_the_radius(wall):
    mesh, depth = wall
    frames = fibres.fibre_frames(mesh, depth, Fibres(), fibres.CENTROID)
    np.testing.assert_allclose(np.linalg.det(frames), 1)
    np.testing.assert_allclose(frames[..., 2, :], fibres.wall_axes(mesh, depth, fibres.CENTROID)[..., 0, :], atol=1e-12)


def test_angles_of_both_sides_come_back(wall):
    mesh, depth = wall
    section = Fibres(endo_deg=60.0, epi_deg=-50.0)
    axes = fibres.wall_axes(mesh, depth, VERTICES)
    frames = fibres.fibre_frames(mesh, depth, section, VERTICES)
    read = np.degrees(fibres.angle_of(frames[..., 0, :], axes))
    at = fibres.at_points(mesh, depth, VERTICES)
    np.testing.assert_allclose(read, 60 - 110 * at, atol=1e-9)
    assert read.max() == pytest.approx(60, abs=2)
    assert read.min() == pytest.approx(-50, abs=2)


def test_stepwise_rule_gives_one_angle_a_layer():
    depth = np.linspace(0, 1, 601)
    angle = fibres.helix_angle(Fibres(stepwise=True), depth)
    np.testing.assert_allclose(np.degrees(np.unique(angle)), np.arange(-31.5, 74, 21))
    np.testing.assert_array_equal(np.unique(fibres.layer(depth, 6)), np.arange(1, 7))


def test_a_fibre_has_no_head():
    axes = np.eye(3)[[0, 1, 2]]
    fibre = np.array([0.0, -np.cos(0.3), -np.sin(0.3)])
    assert fibres.angle_of(fibre, axes) == pytest.approx(0.3)
    assert fibres.angle_of(-fibre, axes) == pytest.approx(0.3)

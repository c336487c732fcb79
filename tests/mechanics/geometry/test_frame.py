"""The frame of an ellipsoid at any position and orientation."""

import numpy as np
import pytest

from echotruth.mechanics.geometry.boundary import boundary
from echotruth.mechanics.geometry.boundary_labels import BASE, ENDO, EPI, BoundarySurface
from echotruth.mechanics.geometry.frame import heart_axes, heart_frame


@pytest.fixture
def surface(file_heart):
    facets, _ = boundary(file_heart.mesh.cells)
    side = np.empty(len(facets), dtype=np.int8)
    for number, named in ((ENDO, file_heart.mesh.endo), (EPI, file_heart.mesh.epi), (BASE, file_heart.mesh.base)):
        side[(facets[:, None] == named[None]).all(axis=2).any(axis=1)] = number
    return BoundarySurface(1e-3 * file_heart.nodes, facets, side)


def test_frame_is_that_in_which_the_heart_was_made(file_heart, surface):
    frame = heart_frame(surface, 1e-3 * (file_heart.shift + 9 * file_heart.turn[0] + 4 * file_heart.turn[2]))
    np.testing.assert_allclose(frame.axes, file_heart.turn, atol=1e-12)
    np.testing.assert_allclose(frame.origin, 1e-3 * file_heart.shift, atol=1e-12)
    np.testing.assert_allclose(frame.transform_points(surface.nodes), file_heart.mesh.nodes, atol=1e-12)
    np.testing.assert_allclose(frame.transform_vectors(file_heart.turn), np.eye(3), atol=1e-12)


def test_base_that_is_not_plane_leaves_the_axis_to_the_apex(file_heart, surface):
    local = file_heart.mesh.nodes.copy()
    local[:, 2] += np.where(local[:, 2] > -2e-3, 300 * local[:, 0] ** 2, 0)
    frame = heart_frame(BoundarySurface(local, surface.facets, surface.labels), None)
    np.testing.assert_allclose(frame.axes[2], [0, 0, 1], atol=0.02)


@pytest.mark.parametrize("septum", [None, np.array([0.0, 0, 5.0])])
def test_axes_are_right_handed_even_where_nothing_says_where_x_is(septum):
    axes = heart_axes(np.array([3.0, 0, 0]) if septum is None else np.array([0, 0, 2.0]), septum, np.zeros(3))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1)

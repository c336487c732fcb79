"""The frame of an ellipsoid that lies anyhow."""

import numpy as np
import pytest

from echotruth.mechanics.geometry.boundary import boundary
from echotruth.mechanics.geometry.boundary_labels import BASE, ENDO, EPI, Skin
from echotruth.mechanics.geometry.frame import apex_of, axes_about, frame_of, rim_centroid


@pytest.fixture
def skin(lying):
    facets, _ = boundary(lying.mesh.cells)
    side = np.empty(len(facets), dtype=np.int8)
    for number, named in ((ENDO, lying.mesh.endo), (EPI, lying.mesh.epi), (BASE, lying.mesh.base)):
        side[(facets[:, None] == named[None]).all(axis=2).any(axis=1)] = number
    return Skin(1e-3 * lying.nodes, facets, side)


def test_frame_is_that_in_which_the_heart_was_made(lying, skin):
    frame = frame_of(skin, 1e-3 * (lying.shift + 9 * lying.turn[0] + 4 * lying.turn[2]))
    np.testing.assert_allclose(frame.axes, lying.turn, atol=1e-12)
    np.testing.assert_allclose(frame.origin, 1e-3 * lying.shift, atol=1e-12)
    np.testing.assert_allclose(frame.points(skin.nodes), lying.mesh.nodes, atol=1e-12)
    np.testing.assert_allclose(frame.directions(lying.turn), np.eye(3), atol=1e-12)


def test_landmarks(lying, skin):
    np.testing.assert_allclose(rim_centroid(skin), 1e-3 * lying.shift, atol=1e-12)
    np.testing.assert_allclose(apex_of(skin), 1e-3 * (lying.shift - 6.8 * lying.turn[2]), atol=2e-4)


def test_base_that_is_not_plane_leaves_the_axis_to_the_apex(lying, skin):
    local = lying.mesh.nodes.copy()
    local[:, 2] += np.where(local[:, 2] > -2e-3, 300 * local[:, 0] ** 2, 0)
    frame = frame_of(Skin(local, skin.facets, skin.side), None)
    np.testing.assert_allclose(frame.axes[2], [0, 0, 1], atol=0.02)


@pytest.mark.parametrize("septum", [None, np.array([0.0, 0, 5.0])])
def test_axes_are_right_handed_even_where_nothing_says_where_x_is(septum):
    axes = axes_about(np.array([3.0, 0, 0]) if septum is None else np.array([0, 0, 2.0]), septum, np.zeros(3))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1)

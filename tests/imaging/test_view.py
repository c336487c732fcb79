"""Views: the probe stands where the conventions say."""

import numpy as np
import pytest

from echotruth.config import Rf, View
from echotruth.imaging.view import imaging_plane

ENDO = np.array([[0, 0, -6e-3], [1e-3, 0, 0], [-1e-3, 0, -1e-3]])


@pytest.mark.parametrize("view", [View(), View(plane="long_axis"), View(plane="long_axis", rotation_deg=60.0)])
def test_axes_are_right_handed_and_of_length_one(view):
    axes = imaging_plane(view, Rf(), ENDO).axes
    assert np.allclose(axes @ axes.T, np.eye(3))
    assert np.allclose(np.cross(axes[0], axes[1]), axes[2])


def test_short_axis_shows_anterior_above_and_septum_on_the_left():
    positions = imaging_plane(View(position=0.5), Rf(), ENDO).to_image(np.array([[0, 2e-3, -3e-3], [2e-3, 0, -3e-3]]))
    anterior, septum = positions
    assert np.allclose(anterior, [0, 4.5e-3, 0])  # 2 mm nearer to the probe than the axis at 6.5 mm
    assert np.allclose(septum, [-2e-3, 6.5e-3, 0])


def test_motion_towards_the_base_is_positive_through_a_short_axis_plane():
    assert np.allclose(imaging_plane(View(), Rf(), ENDO).axes[2], [0, 0, 1])


def test_long_axis_looks_from_the_apex_to_the_base():
    long_axis = imaging_plane(View(plane="long_axis"), Rf(), ENDO)
    apex, base = long_axis.to_image(np.array([[0, 0, -6e-3], [0, 0, 0.0]]))
    assert apex[1] < base[1]
    assert apex[0] == base[0] == 0


def test_image_and_heart_coordinates_are_inverse():
    long_axis = imaging_plane(View(plane="long_axis", rotation_deg=35.0), Rf(), ENDO)
    positions = np.random.default_rng(0).normal(size=(10, 3)) * 1e-3
    assert np.allclose(long_axis.to_heart(long_axis.to_image(positions)), positions, atol=1e-17)

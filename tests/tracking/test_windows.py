import numpy as np
import pytest

from echotruth.tracking.windows import Windows, arrange, grid


def test_remainder_is_split_between_the_borders():
    windows = arrange((30, 45), 8, 0.5)
    assert windows.top[0] == 1 and windows.top[-1] + 8 == 29
    assert windows.left[0] == 0 and windows.left[-1] + 8 == 44


def test_interpolation_is_exact_for_linear_fields_and_nearest_outside():
    windows = arrange((64, 96), 16, 0.5)
    lateral, axial = np.meshgrid(windows.left + 7.5, windows.top + 7.5)
    field = np.stack([2 + 0.3 * lateral - 0.7 * axial, axial], -1)
    points = np.array([[7.5, 7.5], [20.2, 33.3], [71.0, 50.9], [87.5, 55.5]])
    np.testing.assert_allclose(
        windows.interpolate(field, points),
        np.stack([2 + 0.3 * points[:, 0] - 0.7 * points[:, 1], points[:, 1]], -1),
        atol=1e-12,
    )
    corner = windows.interpolate(field, np.array([[0.0, 0.0], [95.0, 63.0]]))
    np.testing.assert_allclose(corner, [field[0, 0], field[-1, -1]])


def test_interpolation_leaves_out_windows_without_a_value():
    windows = Windows(8, np.array([0, 8]), np.array([0, 8]))
    field = np.array([[[1.0], [np.nan]], [[3.0], [np.nan]]])
    points = np.array([[3.5, 7.5], [9.0, 7.5], [11.5, 7.5], [np.nan, 1.0]])
    np.testing.assert_allclose(windows.interpolate(field, points)[:, 0], [2, 2, np.nan, np.nan])


def test_grid_is_lateral_axial_and_starts_half_a_step_in():
    points = grid((30, 50), 10)
    assert points.shape == (3, 5, 2)
    np.testing.assert_array_equal(points[0, 0], [5, 5])
    np.testing.assert_array_equal(points[1, 3], [35, 15])


def test_grid_without_a_point_is_refused():
    with pytest.raises(ValueError, match="no point"):
        grid((16, 16), 40)

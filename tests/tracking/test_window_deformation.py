import numpy as np
import pytest
from scipy import ndimage

from echotruth.config.tracking import WindowDeformation
from echotruth.tracking import track
from echotruth.tracking.correlation import subpixel_peaks
from echotruth.tracking.field import displacement_field, replace_outliers
from echotruth.tracking.trackers import window_deformation
from echotruth.tracking.windows import arrange

SPACING = 3e-5


def step(first, second, points, **settings):
    """Motion of points from one image to another, px."""
    frames = np.stack([first, second])
    mask = np.ones(first.shape, bool)
    return track(frames, points, mask, SPACING, np.arange(2.0), 0, WindowDeformation(**settings))[0][1]


@pytest.fixture
def inner():
    lateral, axial = np.meshgrid(np.arange(45.0, 150, 9), np.arange(45.0, 150, 9))
    return np.stack([lateral, axial], -1).reshape(-1, 2)


@pytest.mark.parametrize("shift", [0.25, 0.5, 9.4])
def test_bias_of_rigid_shifts_is_below_a_fiftieth_of_a_pixel(shifted, inner, shift):
    error = step(shifted(192, 0, 0), shifted(192, shift, -shift), inner) - [shift, -shift]
    assert np.abs(error.mean(0)).max() < 0.02
    assert error.std() < 0.03


def test_deformed_windows_find_a_turn_that_rigid_ones_blur(speckle, inner):
    centre, turn = 95.5, np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]])

    def turned(place):
        return centre + (place - centre) @ turn

    images = speckle(192, lambda place: place), speckle(192, turned)
    truth = turned(inner) - inner
    error = [np.sqrt(((step(*images, inner, final_passes=n) - truth) ** 2).mean()) for n in (1, 4)]
    assert error[1] < 0.1 and error[1] < 0.6 * error[0]


def test_position_of_a_gaussian_peak_is_exact():
    lag = np.arange(-3, 4)
    lateral, axial = np.meshgrid(lag - 0.37, lag + 1.21)
    shift, peak = subpixel_peaks(np.exp(-(lateral**2) / 3 - axial**2 / 5)[None])
    np.testing.assert_allclose(shift[0], [0.37, -1.21], atol=1e-12)
    assert 0.9 < peak[0] < 1


def test_peak_at_the_border_or_beside_negative_correlation_is_unknown():
    edge, lone, unknown = np.full((3, 5, 5), -0.2)
    edge[2, 0], lone[2, 2] = 0.9, 0.9
    unknown[:] = np.nan
    shift, peak = subpixel_peaks(np.stack([edge, lone, unknown]))
    assert np.isnan(shift).all()
    np.testing.assert_allclose(peak, [0.9, 0.9, np.nan])


def test_outliers_become_the_median_of_their_neighbours_and_linear_motion_stays():
    row, column = np.indices((7, 9), float)
    field = np.stack([0.03 * column - 0.01 * row, 0.02 * row], -1)
    spoilt = field.copy()
    spoilt[3, 4], spoilt[1, 6, 1] = [9, -9], np.nan
    np.testing.assert_allclose(replace_outliers(spoilt), field, atol=0.021)
    np.testing.assert_array_equal(replace_outliers(field), field)


def test_missing_vectors_are_the_nearest_there_are_and_none_are_none():
    field = np.full((6, 6, 2), np.nan)
    field[:, :2] = [1.5, -2]
    np.testing.assert_array_equal(replace_outliers(field), np.broadcast_to([1.5, -2], field.shape))
    assert (replace_outliers(np.full((6, 6, 2), np.nan)) == 0).all()


def test_field_between_windows_is_a_cubic_spline_through_their_centres():
    windows = arrange((96, 128), 16, 0.5)
    field = np.random.default_rng(5).normal(size=(len(windows.top), len(windows.left), 2))
    moved = displacement_field(field, windows, (96, 128))
    lateral, axial = np.meshgrid(windows.left + 7.5, windows.top + 7.5)
    np.testing.assert_allclose(
        moved.at(np.stack([lateral, axial], -1).reshape(-1, 2)).reshape(field.shape), field, atol=1e-5
    )
    between = ndimage.map_coordinates(field[..., 0], [[3.3, 0], [5.9, 4]], order=3, mode="mirror")
    points = np.array([[windows.left[5] + 7.5 + 0.9 * 8, windows.top[3] + 7.5 + 0.3 * 8], [windows.left[4] + 7.5, 2]])
    np.testing.assert_allclose(moved.at(points)[:, 0], between, atol=1e-5)
    assert np.isnan(moved.at(np.array([[-0.1, 5.0], [5.0, 95.1], [np.nan, 5.0]]))).all()


def test_windows_are_the_same_tissue_at_every_size_but_eight_pixels_at_least():
    settings = WindowDeformation(windows_mm=[1.5, 0.75, 0.375], final_passes=2)
    found = [window_deformation.window_sides(settings, 12e-3 / n) for n in (512, 256, 128)]
    assert found == [[64, 32, 16, 16], [32, 16, 8, 8], [16, 8, 8, 8]]


def test_image_without_room_for_two_windows_is_refused():
    with pytest.raises(ValueError, match="60 x 200 px has no room for two windows of 50 px"):
        window_deformation.window_passes(WindowDeformation(), (60, 200), SPACING)

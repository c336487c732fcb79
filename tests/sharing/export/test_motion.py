"""Point tracks as TAP-Vid has them, of a heart that is shifted by known steps."""

import numpy as np
import pytest
from known_repository import FRAMES, SHIFT, SIZES

from echotruth.imaging.flow import slice_thickness

STEP = SHIFT / (FRAMES - 1)
"""Shift from frame to frame: lateral, axial, elevation, m."""


@pytest.fixture(scope="module")
def tap(exported_once):
    with np.load(exported_once("tap")) as archive:
        return dict(archive)


def test_arrays_are_those_of_tap_vid(tap, known):
    count = len(tap["points"])
    assert (tap["video"].shape, tap["video"].dtype) == ((FRAMES, SIZES[0], SIZES[0], 3), np.uint8)
    assert (tap["points"].shape, tap["points"].dtype) == ((count, FRAMES, 2), np.float32)
    assert (tap["occluded"].shape, tap["occluded"].dtype) == ((count, FRAMES), np.bool_)
    np.testing.assert_array_equal(tap["video"][..., 1], known.images(SIZES[0]))
    assert float(tap["spacing_m"]) == pytest.approx(12e-3 / SIZES[0])
    assert float(tap["frame_time_s"]) == pytest.approx(0.12 / FRAMES)


def test_points_start_at_pixels_of_the_wall_and_move_by_the_shift(tap, known):
    """Times width and height, they are raster coordinates: the pixel of a point is their integer part."""
    raster = tap["points"] * SIZES[0]
    column, row = np.floor(raster[:, 0]).astype(int).T
    wall = known.labels("mid", SIZES[0])["mask"][0]
    assert wall[row, column].all() and len(raster) > 300
    for frame in range(FRAMES):
        moved = (raster[:, frame] - raster[:, 0]) * known.spacing
        np.testing.assert_allclose(moved, np.broadcast_to(frame * STEP[:2], moved.shape), atol=2e-9)
        np.testing.assert_allclose(tap["elevation_m"][:, frame], frame * STEP[2], atol=1e-9)


def test_point_is_occluded_where_it_is_beside_the_slice(tap, known):
    """Farther from the plane than half the thickness of the slice; every point is within the sector."""
    place = (tap["points"] * SIZES[0]) * known.spacing - [6e-3, 0]
    half = slice_thickness(known.config, np.linalg.norm(place, axis=-1)) / 2
    beside = np.abs(tap["elevation_m"]) > half
    sure = np.abs(np.abs(tap["elevation_m"]) - half) > 1e-6
    np.testing.assert_array_equal(tap["occluded"][sure], beside[sure])
    assert not tap["occluded"][:, 0].any()

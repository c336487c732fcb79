"""What the viewer shows, without a browser, against the numbers that were stored."""

import numpy as np
import pytest
from known_repository import FRAMES, SIZES
from known_repository import SHIFT as MOTION
from shown_repository import PIXEL, SHIFT

from echotruth.viewer import curves
from echotruth.viewer.clip import Clip
from echotruth.viewer.paths import paths
from echotruth.viewer.points import Points
from echotruth.viewer.tint import COLOURS, components, tint


@pytest.fixture
def clip(repository):
    return Clip(repository, "heart", "mid", SIZES[0])


@pytest.fixture
def points(clip):
    return Points(clip)


def value(colours, index):
    """Value that an entry of the palette stands for: the middle of its step; NaN where it is transparent."""
    step = (colours.high - colours.low) / len(colours.palette)
    return np.where(index > 0, colours.low + (index - 0.5) * step, np.nan)


def test_point_covers_the_pixel_where_it_is(points, shown):
    row, column = np.floor(shown.position[:, ::-1] / PIXEL + [0, SIZES[0] / 2]).astype(int).T
    np.testing.assert_array_equal(points.coverage[0][row, column], np.arange(1, len(shown.position) + 1))


def test_coverage_moves_with_the_true_motion(points):
    np.testing.assert_array_equal(points.coverage[-1], np.roll(points.coverage[0], (-2, 3), axis=(0, 1)))


def test_ring_is_covered_without_a_gap(points, shown):
    radius = np.hypot(*np.meshgrid(*2 * [(np.arange(SIZES[0]) + 0.5) * PIXEL - 6e-3]))
    within = (radius > 2.9e-3) & (radius < 4.6e-3)
    assert (points.coverage[0][within] > 0).all()


def test_coverage_of_a_smaller_image_is_that_of_the_large_one(repository, points):
    small = Points(Clip(repository, "heart", "mid", SIZES[1])).coverage
    large = points.coverage[:, ::2, ::2]
    known = (small > 0) & (large > 0)
    assert known.sum() > 0.9 * (large > 0).sum()
    position = points.position
    assert np.abs(position[small[known] - 1] - position[large[known] - 1]).max() <= 1.01 * points.spacing


@pytest.mark.parametrize(("tracker", "found"), [("one", 1e-4), ("two", 2e-4)])
def test_colour_of_the_error_is_the_distance_of_tracked_from_true(clip, points, tracker, found):
    colours = tint(clip, points, "displacement_error", "", tracker)
    covered = points.coverage > 0
    assert ((colours.index > 0) == covered).all()
    half_step = (colours.high - colours.low) / 255 / 2
    for frame, share in enumerate(np.arange(FRAMES) / (FRAMES - 1)):
        error = 1e6 * np.hypot(*(found - share * SHIFT[:2]))
        shown = value(colours, colours.index[frame][covered[frame]])
        np.testing.assert_allclose(shown, min(error, colours.high), atol=1.1 * half_step)


def test_no_strain_of_a_rigid_motion(clip, points):
    colours = tint(clip, points, "tracked_strain", "TT", "one")
    step = (colours.high - colours.low) / 255
    shown = value(colours, colours.index[-1])
    assert np.abs(shown[np.isfinite(shown)]).max() <= step


def test_true_strain_is_that_of_every_pixel(clip, points):
    stored = clip.strain("CC")
    colours = tint(clip, points, "strain", "CC", None)
    assert ((colours.index > 0) == np.isfinite(stored)).all()
    assert colours.low == -colours.high


def test_segments_and_layers_are_the_stored_labels(clip, points):
    for name in ("segment", "layer"):
        colours, stored = tint(clip, points, name, "", None), clip.label(name)
        numbers = [int(text.split(" ")[0]) for text in colours.names.values()]
        back = np.array([0, *numbers])[colours.index]
        np.testing.assert_array_equal(back, stored)


def test_speed_is_the_motion_to_the_next_frame_over_its_time(clip, points):
    colours = tint(clip, points, "flow", "", None)
    step_time = clip.time[1] - clip.time[0]
    speed = 1e3 * np.hypot(*MOTION[:2]) / (FRAMES - 1) / step_time
    shown = value(colours, colours.index[0])
    np.testing.assert_allclose(shown[np.isfinite(shown)], speed, rtol=0.02)
    assert (colours.index[-1] == 0).all()


@pytest.mark.parametrize("colour", COLOURS)
def test_every_colour_can_be_made(clip, points, colour):
    for component in components(colour) or ("",):
        made = tint(clip, points, colour, component, "one")
        assert (made is None) == (colour == "none")
        assert made is None or made.index.shape == (FRAMES, SIZES[0], SIZES[0])


def test_paths_are_where_some_points_are(points):
    for displacement in (points.true_displacement, points.tracked_displacement("two")):
        known = {tuple(place) for place in (1e3 * (points.position + displacement[-1])).astype(np.float32).tolist()}
        drawn = {tuple(place) for place in paths(points, displacement)[-1].tolist()}
        assert drawn <= known and 20 < len(drawn) < len(known)


def test_curves_are_those_of_the_evaluation(clip):
    found = {name: clip.repository.curves(clip.case, clip.view, name, clip.size) for name in ("one", "two")}
    line = curves.strain(clip, found, curves.LINE, "engineering", "middle").curves
    assert {name: round(float(values[1]), 3) for name, values in line.items()} == {"true": -14, "one": -12, "two": -22}
    segment = curves.strain(clip, found, "TT", "engineering", f"segment {curves.segments(found['one'])[0]}").curves
    assert {name: round(float(values[1]), 3) for name, values in segment.items()} == {"true": 41, "one": 11, "two": 21}
    rotation = curves.rotation(clip, found).curves
    np.testing.assert_allclose([values[0] for values in rotation.values()], np.degrees([0.15, 0.13, 0.23]), rtol=1e-5)

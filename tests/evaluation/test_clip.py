"""Clips of a scanner with a lower frame rate: what trackers are given, and the motion in the frames between."""

import numpy as np
import pytest

from echotruth.config import Config
from echotruth.config.loading import ConfigError, validate
from echotruth.evaluation.clip import Clip, between_frames

FRAMES, PERIOD = 8, 0.12


def course(frame, knots):
    """Position at a frame of a path that is linear between knots and back at its first one a period later."""
    return np.interp(frame, [*knots, FRAMES], [*(knot * (FRAMES - knot) for knot in knots), 0.0])


@pytest.mark.parametrize("step", [1, 2, 3, 5, 7])
def test_path_that_is_linear_between_the_given_frames_and_closes_is_returned_exactly(step):
    knots = np.arange(0, FRAMES, step)
    path = course(np.arange(FRAMES), knots)[:, None] * [1.0, -2.0]
    np.testing.assert_allclose(between_frames(path[::step], step, FRAMES), path, rtol=0, atol=1e-12)


def test_given_frames_stay_as_they_are_and_what_lies_beside_an_unknown_one_is_unknown():
    given = np.array([0.0, 1.0, np.nan, 3.0])
    found = between_frames(given, 2, FRAMES)
    np.testing.assert_array_equal(found[::2], given)
    np.testing.assert_array_equal(np.isnan(found), [False, False, False, True, True, True, False, False])
    assert found[7] == 1.5  # half-way from the last given frame to end-diastole


@pytest.mark.parametrize("step", [2, 3, 5])
def test_path_of_an_open_clip_does_not_lead_back_after_the_last_given_frame(step):
    drift = np.arange(FRAMES)[:, None] * [1.0, -2.0]
    last = (FRAMES - 1) // step * step
    found = between_frames(drift[::step], step, FRAMES, is_closed=False)
    np.testing.assert_allclose(found, np.minimum(np.arange(FRAMES), last)[:, None] * [1.0, -2.0], rtol=0, atol=1e-12)


@pytest.fixture
def clip():
    """Function from a step to a clip of random images with three points."""
    images = np.random.default_rng(1).integers(0, 255, (FRAMES, 16, 16), np.uint8)
    inside = np.array([[True, False], [True, True]])
    points = np.array([[4.0, 4.0], [4.0, 9.0], [9.0, 9.0]])
    time = np.arange(FRAMES) / FRAMES * PERIOD
    return lambda step: Clip(images, np.ones((16, 16), bool), inside, points, 1e-5, time, 1, step)


def test_tracker_is_given_every_second_frame_with_its_own_time(clip):
    all_frames, half = clip(1), clip(2)
    frames, _, _, _, time, _ = half.tracker_arguments
    np.testing.assert_array_equal(frames, all_frames.frames[::2])
    np.testing.assert_allclose(np.diff(time), 2 * PERIOD / FRAMES)


def test_motion_of_every_third_frame_is_on_the_grid_in_all_frames(clip):
    third = clip(3)
    speed = np.array([[1.0, 0.0], [0.0, 2.0], [-1.0, 1.0]])  # px per frame
    given = np.arange(0, FRAMES, 3)
    displacement, quality = third.on_grid(given[:, None, None] * speed, np.ones((len(given), 3)))
    expected = np.arange(7)[:, None, None] * speed * third.spacing
    np.testing.assert_allclose(displacement[:7, third.inside], expected, atol=1e-18)
    np.testing.assert_allclose(displacement[7, third.inside], 6 * speed / 2 * third.spacing)
    assert np.isnan(displacement[:, ~third.inside]).all() and (quality[:, third.inside] == 1).all()


def test_tracker_that_failed_has_no_estimate_in_any_frame(clip):
    displacement, quality = clip(3).on_grid(*clip(3).no_estimate)
    assert displacement.shape == (FRAMES, 2, 2, 2) and quality.shape == (FRAMES, 2, 2)
    assert np.isnan(displacement).all() and np.isnan(quality).all()


def test_step_that_leaves_one_frame_is_refused():
    assert validate({"loop": {"frames": 4}, "tracking": {"frame_step": 3}}, "a.yaml").tracking.frame_step == 3
    with pytest.raises(ConfigError, match=r"tracking.frame_step = 4: must be smaller than loop.frames = 4"):
        validate({"loop": {"frames": 4}, "tracking": {"frame_step": 4}}, "a.yaml")
    assert Config().tracking.frame_step == 1

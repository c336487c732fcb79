import numpy as np
import pytest
from echotruth.tracking.motion import window_side

from echotruth.config import PhaseCorrelation
from echotruth.tracking import grid, track

ED = PhaseCorrelation()
STEPS = PhaseCorrelation(taper="hann", reference="previous")
SPACING = 25e-6


@pytest.mark.parametrize("tracker", [ED, STEPS])
def test_rigid_shift_is_followed_in_metres(clip, tracker):
    frames = clip(lambda place, t: place + np.array([2 * t, -3 * t]), 5)
    points = grid(frames.shape[1:], 20).reshape(-1, 2)
    moved, quality = track(frames, points, tracker, SPACING)
    assert moved.shape == (5, 64, 2) and quality.shape == (5, 64)
    assert (moved[0] == 0).all() and (quality[0] == 1).all()
    inner = (np.abs(points - 79.5) < 50).all(1)
    truth = np.arange(5)[:, None] * np.array([2, -3]) * SPACING
    assert np.abs(moved[:, inner] - truth[:, None]).max() < 0.5 * SPACING


def test_rotation_is_followed_along_the_path(clip):
    centre = np.array([79.5, 79.5])

    def turn(place, t):
        cosine, sine = np.cos(0.04 * t), np.sin(0.04 * t)
        return centre + (place - centre) @ np.array([[cosine, sine], [-sine, cosine]])

    frames = clip(turn, 9)
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    points = centre + 45 * np.stack([np.cos(angle), np.sin(angle)], -1)
    tracker = PhaseCorrelation(window_px=32, taper="hann", reference="previous")
    moved, _ = track(frames, points, tracker, SPACING)
    truth = (turn(points, 8) - points) * SPACING
    assert np.linalg.norm(truth, axis=1).min() > 14 * SPACING
    assert np.sqrt(np.mean((moved[-1] - truth) ** 2)) < SPACING


def test_path_and_place_of_rest_differ(clip):
    """Where motion varies in space, a step is read where the point is and not where it was at end-diastole."""
    frames = clip(lambda place, t: place * [1 + 0.02 * t, 1], 7)
    points = np.array([[100.0, 80.0]])
    moved, _ = track(frames, points, PhaseCorrelation(window_px=32, taper="hann", reference="previous"), SPACING)
    assert moved[-1, 0, 0] / SPACING == pytest.approx(12, abs=0.8)


def test_window_in_tissue_keeps_its_size():
    tracker = PhaseCorrelation(window_px=None, window_mm=1.5)
    assert [window_side(tracker, 12e-3 / n) for n in (512, 256, 128)] == [64, 32, 16]
    assert window_side(tracker, 1e-3) == 8
    assert window_side(ED, 1.0) == 64


def test_clips_without_texture_have_no_displacement():
    points = np.array([[40.0, 40.0]])
    for value in (0, 0.1, 200, np.nan):
        moved, quality = track(np.full((3, 80, 80), value), points, ED, SPACING)
        assert np.isnan(moved[1:]).all() and np.isnan(quality[1:]).all()


def test_lost_point_stays_lost_frame_to_frame(clip):
    frames = clip(lambda place, t: place + np.array([t, 0]), 4, size=80)
    frames[2] = 0
    points = np.array([[40.0, 40.0]])
    steps, _ = track(frames, points, STEPS, SPACING)
    assert np.isfinite(steps[1]).all() and np.isnan(steps[2:]).all()
    direct, _ = track(frames, points, ED, SPACING)
    assert np.isnan(direct[2]).all() and np.isfinite(direct[3]).all()


def test_images_need_not_be_square(speckle):
    frames = np.stack([speckle(160, lambda place, t=t: place + np.array([0, t]))[:, 20:120] for t in range(3)])
    moved, _ = track(frames, grid(frames.shape[1:], 30).reshape(-1, 2), ED, SPACING)
    np.testing.assert_allclose(np.median(moved[2] / SPACING, axis=0), [0, 2], atol=0.2)


def test_same_input_same_output(clip):
    frames = clip(lambda place, t: place + np.array([t, 0]), 3, size=80)
    points = grid((80, 80), 10).reshape(-1, 2)
    for tracker in (ED, STEPS):
        np.testing.assert_array_equal(*(track(frames, points, tracker, SPACING)[0] for _ in range(2)))


@pytest.mark.parametrize(
    "frames, points, spacing, message",
    [
        (np.zeros((1, 80, 80)), np.zeros((1, 2)), SPACING, "two or more frames"),
        (np.zeros((80, 80)), np.zeros((1, 2)), SPACING, "two or more frames"),
        (np.zeros((2, 40, 80)), np.zeros((1, 2)), SPACING, "larger than the image"),
        (np.zeros((2, 80, 80)), np.zeros((1, 3)), SPACING, "point, 2"),
        (np.zeros((2, 80, 80)), np.zeros((1, 2)), 0, "positive length"),
    ],
)
def test_impossible_input_is_refused_in_a_sentence(frames, points, spacing, message):
    with pytest.raises(ValueError, match=message):
        track(frames, points, ED, spacing)

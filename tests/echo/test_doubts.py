"""What of a tracked ring should make one doubt, and that nothing is said of a ring that is followed."""

import numpy as np
import pytest
from contracting_ring import CENTRE, FRAMES, SIDE
from scipy.ndimage import gaussian_filter

import echotruth as et
from echotruth.echo import page
from echotruth.tracking.plausibility import is_noise


def notes(ring, frames=None, tracker="dis"):
    clip = et.read_clip(ring.frames if frames is None else frames, spacing_mm=0.04, frame_time_ms=10)
    return et.speckle_tracking(clip, ring.wall(), tracker).attrs["notes"]


def moving(displaced):
    """Tracker that moves points by a function of their place about the centre, px, once there and back, and is sure."""

    def track(frames, points, *_):
        moved = np.sin(np.pi * np.arange(FRAMES) / FRAMES)[:, None, None] ** 2 * displaced(points - CENTRE)
        return moved, np.ones(moved.shape[:2])

    return track


def evenly(place):
    return -0.1 * place


def noise(seed, smooth):
    values = gaussian_filter(np.random.default_rng(seed).normal(size=(FRAMES, SIDE, SIDE)), (0, smooth, smooth))
    return np.clip(128 + 45 * values / values.std(), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("smooth", [0, 2])
def test_noise_has_no_strain(ring, smooth):
    clip = et.read_clip(noise(0, smooth), spacing_mm=0.04, frame_time_ms=10)
    strain = et.speckle_tracking(clip, ring.wall(), "dis")
    assert np.isnan(strain.attrs["gcs_percent"]) and np.isnan(strain["strain"]).all()
    assert strain.attrs["notes"].startswith("consecutive frames have nothing in common in the wall, as in noise")
    assert "beats" not in strain.attrs["notes"]


def test_page_of_noise_says_that_no_motion_is_found(ring, tmp_path):
    clip = et.read_clip(noise(0, 1), spacing_mm=0.04, frame_time_ms=10)
    strain = et.speckle_tracking(clip, ring.wall(), "dis")
    page.draw(clip, strain, tmp_path / "noise.png")
    assert "unknown (doubtful)" in page.headline(strain) and np.isnan(strain.attrs["drift_percent"])


def test_noise_is_told_from_a_ring_in_noise(ring):
    mask = ring.wall().mask((SIDE, SIDE))
    darker = noise(1, 1) * np.linspace(0.3, 1, SIDE)[:, None]
    assert is_noise(darker, mask) and is_noise(np.repeat(noise(2, 1), 2, axis=0), mask)
    assert all(is_noise(noise(seed, smooth), mask) for seed in range(20) for smooth in (0, 1, 2))
    assert not is_noise(np.clip(ring.frames + 2.0 * noise(0, 0), 0, 255), mask)


def test_motion_that_the_tracker_is_not_sure_of_or_says_nothing_of_is_told(ring):
    def sure(quality):
        def track(frames, points, *arguments):
            moved, _ = moving(evenly)(frames, points, *arguments)
            return moved, np.full(moved.shape[:2], quality)

        return track

    assert notes(ring, tracker=sure(0.26)) == ""
    assert notes(ring, tracker=sure(0.1)) == (
        "the quality at end-systole is 0.10, and below 0.25 in noise: the motion is not found"
    )
    assert notes(ring, tracker=sure(np.nan)) == (
        "the tracker does not say how sure it is: nothing tells a motion that it has not found"
    )


def test_wall_that_hardly_moves_is_told(ring):
    told = notes(ring, tracker=moving(lambda place: 0.01 * place))
    assert told == "the wall moves by 2.1 % of its thickness at most, as if nothing moved: is it a heart?"


def test_ring_in_noise_that_is_still_followed_is_not_doubted(ring):
    noise = np.random.default_rng(1).normal(0, 40, ring.frames.shape)
    assert notes(ring, np.clip(ring.frames + noise, 0, 255).astype(np.uint8)) == ""


@pytest.mark.parametrize("beats", [2, 3])
def test_several_beats_are_told_with_their_period(ring, beats):
    told = notes(ring, np.tile(ring.frames, (beats, 1, 1)))
    assert told == (
        f"the motion comes again after 100 ms, so that the clip holds {beats} beats: choose a cycle of 10 frames"
    )


def test_line_that_crosses_itself_is_told(ring):
    """A ring is turned into an eight."""

    def eight(place):
        return np.column_stack([np.zeros(len(place)), 2 * place[:, 0] * place[:, 1] / 48 - place[:, 1]])

    assert "the endocardial line crosses itself in " in notes(ring, tracker=moving(eight))
    assert notes(ring, tracker=moving(evenly)) == ""


def test_segments_that_differ_threefold_are_named(ring):
    def at_right(place):
        return evenly(place) * (place[:, :1] > 0)

    told = notes(ring, tracker=moving(at_right))
    assert "segments differ threefold or more (" in told and "(8 mid anteroseptal -0 %, " in told


def test_steps_that_are_large_for_the_wall_are_told(ring):
    told = notes(ring, tracker=moving(lambda place: 30 + 0 * place))
    assert told.startswith("the wall moves by 55 % of its thickness up to frame ")


def test_drift_of_less_than_a_third_of_a_pixel_is_none(ring):
    for left_px, told in ((0.3, False), (0.6, True)):

        def track(frames, points, *_, left_px=left_px):
            return np.linspace(0, left_px, FRAMES)[:, None, None] * np.ones_like(points) / np.sqrt(2)

        assert ("is left in the last frame" in notes(ring, tracker=track)) == told

"""Clips of scatterers that swing to one side and back, of which all or only the way there is shown."""

import logging

import numpy as np
import pytest

from echotruth.config.tracking import BsplineDic, Dis
from echotruth.tracking import track
from echotruth.tracking.closure import Closure, closure

FRAMES, SWING, SIZE = 16, 28.0, 128
MASK = np.zeros((SIZE, SIZE), bool)
MASK[40:88, 30:70] = True
POINTS = np.array([[40.0, 50.0], [50.0, 64.0], [60.0, 75.0]])


def lateral(frame):
    """Displacement in a frame, px."""
    return SWING * np.sin(np.pi * np.asarray(frame) / FRAMES) ** 2


@pytest.fixture(scope="module")
def swing(clip):
    return clip(lambda position, frame: position + np.array([lateral(frame), 0.0]), FRAMES, SIZE)


@pytest.fixture(scope="module")
def renewed():
    """Clip of a ring that contracts by an eighth and widens again; a share of its echoes is new in each frame."""

    def make(share, count, size=SIZE):
        random, pixel, middle = np.random.default_rng(3), np.arange(size)[:, None], size / 2
        position = random.uniform(-20, size + 20, (size**2 // 8, 2))
        radius = np.hypot(*(position - middle).T)
        level, weight = np.where(abs(radius - 42) < 10, 1, 0.1), random.normal(size=(2, len(position)))
        contraction, frames = np.sin(np.pi * np.arange(count) / count) ** 2 / 8, []
        for part in contraction:
            lateral, axial = (np.exp(-((pixel - x) ** 2) / 8) for x in (middle + (1 - part) * (position - middle)).T)
            envelope = np.hypot(*(axial * (one * level) @ lateral.T for one in weight))
            frames.append(np.clip(255 + 255 / 50 * 20 * np.log10(envelope / 6), 0, 255).round().astype(np.uint8))
            weight = (1 - share) * weight + np.sqrt(1 - (1 - share) ** 2) * random.normal(size=weight.shape)
        angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        points = middle + 42 * np.stack([np.cos(angle), np.sin(angle)], -1)
        mask = abs(np.hypot(*(np.indices((size, size)) - middle)) - 42) < 10
        return np.array(frames), mask, points, -contraction[:, None, None] * (points - middle)

    return make


def tracked(frames, settings):
    return track(frames, POINTS, MASK, 1e-4, 0.003 * np.arange(len(frames)), 1, settings)[0]


def test_cycle_closes_and_half_of_it_does_not(swing):
    whole, half = closure(swing, MASK), closure(swing[: FRAMES // 2], MASK)
    assert whole.closing >= whole.consecutive and whole.displacement < 0.1
    assert not whole.is_open and whole.is_followed
    assert half.closing < half.consecutive - 0.2
    assert half.is_open and not half.is_followed


def test_clip_is_open_if_tissue_is_far_away_though_its_speckle_is_the_same(clip):
    away, shown = 3.0 / SWING, 8
    frames = clip(lambda position, frame: position + np.array([away * lateral(frame), 0.0]), FRAMES, SIZE)
    found = closure(frames[:shown], MASK)
    assert found.closing > 0.9 and found.displacement > 0.9
    assert found.is_open and not closure(frames, MASK).is_open


@pytest.mark.parametrize(
    ("displacement", "closing", "is_open", "is_followed"),
    [
        (0.1, 0.9, False, True),
        (0.1, 0.7, False, True),  # speckle does not come back as it was
        (0.1, 0.1, False, True),  # nor at all
        (0.9, 0.9, True, True),
        (0.9, 0.7, True, False),
    ],
)
def test_last_frame_is_followed_to_the_first_where_it_is_as_like_as_others_or_near(
    displacement, closing, is_open, is_followed
):
    found = Closure(displacement, closing, consecutive=0.8)
    assert (found.is_open, found.is_followed) == (is_open, is_followed)


def test_cycle_in_which_speckle_is_renewed_is_closed_and_half_of_it_open(renewed, caplog):
    """A twentieth is new in each frame, so that little of the speckle of the first is left in the last."""
    frames, mask, points, motion = renewed(0.05, 40)
    whole, half = closure(frames, mask), closure(frames[:20], mask)
    assert whole.closing < 0.6 * whole.consecutive
    assert not whole.is_open and whole.is_followed and whole.displacement < 0.35
    assert half.is_open and not half.is_followed and half.displacement > 0.9
    with caplog.at_level(logging.WARNING):
        found = track(frames, points, mask, 1e-4, 0.003 * np.arange(40), 1, Dis())[0]
    assert not caplog.text
    assert np.hypot(*(found - motion)[-1].T).mean() < 0.7


def test_open_clip_that_stays_alike_is_tracked_both_ways_with_a_word(clip, caplog):
    frames = clip(lambda position, frame: position + np.array([lateral(frame) / 9, 0.0]), FRAMES, SIZE)[: FRAMES // 2]
    with caplog.at_level(logging.WARNING):
        found = tracked(frames, Dis())
    assert "no closed cycle" in caplog.text and "both ways" in caplog.text
    np.testing.assert_allclose(found[-1, :, 0], lateral(FRAMES // 2 - 1) / 9, atol=0.3)


@pytest.mark.parametrize("settings", [Dis, BsplineDic])
def test_displacement_of_a_cycle_that_drifts_is_not_drawn_back_to_its_beginning(clip, settings):
    """It is near enough to be tracked both ways, of which the backward one begins with the whole drift."""
    drift = np.array([1.5, -1.0]) / FRAMES

    def motion(position, frame):
        return position + np.array([lateral(frame) / 2, 0.0]) + drift * frame

    frames = clip(motion, FRAMES, SIZE)
    assert closure(frames, MASK).is_followed
    found = tracked(frames, settings())
    np.testing.assert_allclose(found[-1], [[lateral(FRAMES - 1) / 2, 0] + drift * (FRAMES - 1)] * 3, atol=0.2)


@pytest.mark.parametrize("noise", [0, 8])
def test_clip_of_which_nothing_moves_is_taken_for_a_cycle(clip, noise):
    still = clip(lambda position, frame: position, FRAMES, SIZE)
    noisy = still + np.random.default_rng(1).integers(-noise, noise + 1, still.shape)
    found = closure(np.clip(noisy, 0, 255).astype(np.uint8), MASK)
    assert np.isnan(found.displacement) and not found.is_open


def test_two_frames_are_taken_for_a_cycle(swing):
    assert not closure(swing[[0, 4]], MASK).is_open


def test_black_frame_does_not_make_an_open_clip_a_closed_one(swing):
    half = swing[: FRAMES // 2].copy()
    half[3] = 0
    assert np.isfinite(closure(half, MASK).consecutive) and closure(half, MASK).is_open


def test_bright_tissue_at_rest_does_not_make_an_open_clip_a_closed_one(clip, swing):
    still = clip(lambda position, frame: position, FRAMES, SIZE)[: FRAMES // 2]
    dim = swing[: FRAMES // 2].copy()
    dim[:, :, 36:] = np.maximum(dim[:, :, 36:], 100) - 100  # 20 dB
    dim[:, :, :36] = still[:, :, :36]
    assert closure(dim, MASK).is_open and not closure(dim, MASK).is_followed


@pytest.mark.parametrize("settings", [Dis, BsplineDic])
def test_open_clip_is_tracked_as_forwards_only_with_a_word(swing, settings, caplog):
    half = swing[: FRAMES // 2]
    with caplog.at_level(logging.WARNING):
        found = tracked(half, settings())
    assert "no closed cycle" in caplog.text
    np.testing.assert_array_equal(found, tracked(half, settings(reference="previous")))
    np.testing.assert_allclose(found[-1, :, 0], lateral(FRAMES // 2 - 1), atol=1.0)


def test_closed_clip_is_tracked_both_ways_without_a_word(swing, caplog):
    with caplog.at_level(logging.WARNING):
        both = tracked(swing, Dis())
    assert not caplog.text
    assert not np.array_equal(both, tracked(swing, Dis(reference="previous")))


def test_clip_without_texture_is_taken_for_a_cycle():
    found = closure(np.zeros((4, SIZE, SIZE), np.uint8), MASK)
    assert np.isnan(found.closing) and np.isnan(found.consecutive)
    assert not found.is_open

"""Clips of scatterers that swing to one side and back, of which all or only the way there is shown."""

import logging

import numpy as np
import pytest

from echotruth.config.tracking import BsplineDic, Dis
from echotruth.tracking import track
from echotruth.tracking.closure import closing_correlation, is_open

FRAMES, SWING, SIZE = 16, 28.0, 128
MASK = np.zeros((SIZE, SIZE), bool)
MASK[40:88, 30:70] = True
POINTS = np.array([[40.0, 50.0], [50.0, 64.0], [60.0, 75.0]])


def lateral(frame):
    """Displacement in a frame, px."""
    return SWING * np.sin(np.pi * np.asarray(frame) / FRAMES) ** 2


@pytest.fixture
def swing(clip):
    return clip(lambda position, frame: position + np.array([lateral(frame), 0.0]), FRAMES, SIZE)


def tracked(frames, settings):
    return track(frames, POINTS, MASK, 1e-4, 0.003 * np.arange(len(frames)), 1, settings)[0]


def test_cycle_closes_and_half_of_it_does_not(swing):
    closing, consecutive = closing_correlation(swing, MASK)
    assert closing >= consecutive
    assert not is_open(closing, consecutive)
    closing, consecutive = closing_correlation(swing[: FRAMES // 2], MASK)
    assert closing < consecutive - 0.2
    assert is_open(closing, consecutive)


def test_bright_tissue_at_rest_does_not_make_an_open_clip_a_closed_one(clip, swing):
    still = clip(lambda position, frame: position, FRAMES, SIZE)[: FRAMES // 2]
    dim = swing[: FRAMES // 2].copy()
    dim[:, :, 36:] = np.maximum(dim[:, :, 36:], 100) - 100  # 20 dB
    dim[:, :, :36] = still[:, :, :36]
    assert is_open(*closing_correlation(dim, MASK))


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
    closing, consecutive = closing_correlation(np.zeros((4, SIZE, SIZE), np.uint8), MASK)
    assert np.isnan(closing) and np.isnan(consecutive)
    assert not is_open(closing, consecutive)

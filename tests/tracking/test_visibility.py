"""Places of the image that show noise are found, and the tissue around them is tracked as if they were not there."""

import numpy as np
import pytest
from scipy import ndimage

from echotruth.config.tracking import BsplineDic
from echotruth.tracking import track
from echotruth.tracking.visibility import NOISE_NCC, visibility

SIZE, FRAMES = 128, 12
MIDDLE = np.array([63.5, 63.5])


def motion(place, t):
    """Turn, thickening and shift of a ring over a cycle."""
    beat = np.sin(np.pi * t / FRAMES) ** 2
    angle, arm = 0.1 * beat, place - MIDDLE
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return MIDDLE + (1 - 0.15 * beat) * arm @ turn + beat * np.array([2, 1])


@pytest.fixture
def shadow():
    """Where a sector of ten degrees from above is, (axial, lateral)."""
    row, column = np.indices((SIZE, SIZE))
    return np.abs(np.degrees(np.arctan2(column - 63.5, row + 20)) + 14) < 5


@pytest.fixture
def shadowed(clip, shadow):
    """A clip with noise in the shadow, 26 dB below the brightest echo and new in every frame."""
    random = np.random.default_rng(3)
    noise = np.hypot(*ndimage.gaussian_filter(random.normal(size=(2, FRAMES, SIZE, SIZE)), (0, 0, 1.5, 1.5)))
    grey = np.clip(255 * (1 + (20 * np.log10(noise / noise.max()) - 20) / 50), 0, 255)
    return np.where(shadow, grey, clip(motion, FRAMES, SIZE)).astype(np.uint8)


def rms(values):
    return np.sqrt(np.mean(values**2))


def ring():
    row, column = np.indices((SIZE, SIZE))
    radius = np.hypot(column - 63.5, row - 63.5)
    mask = (radius > 22) & (radius < 48)
    return mask, np.argwhere(mask)[::23, ::-1].astype(float)


def test_blocks_are_unseen_whose_mean_correlation_is_that_of_noise_and_those_around_them():
    random = np.random.default_rng(0)
    place = np.argwhere(np.ones((40, 40)))[:, ::-1].astype(float)
    noise = place[:, 0] < 12
    matches = [(place, np.where(noise, random.normal(0, 0.4, 1600), random.normal(0.5, 0.2, 1600))) for _ in range(20)]
    seen = visibility(matches, (40, 40), 4.0, 0)
    assert not seen.at(place[place[:, 0] < 6]).any()
    assert (seen.at(place[place[:, 0] > 18]) == 1).all()
    assert seen.seen.mean() > visibility(matches, (40, 40), 4.0, 1).seen.mean()


def test_what_was_never_looked_for_or_has_no_texture_is_not_called_unseen():
    place = np.array([[5.0, 5.0], [30.0, 30.0]])
    found = visibility([(place, np.array([1.0, np.nan]))], (40, 40), 4.0, 2)
    assert found.seen.all() and NOISE_NCC < 0.5


def test_tissue_beside_a_shadow_is_not_held_by_it_and_that_within_moves_with_it(shadow, shadowed):
    mask, points = ring()
    displacement, quality = track(shadowed, points, mask, 25e-6, np.arange(FRAMES) * 5e-3, 0, BsplineDic())
    true = np.stack([motion(points, t) - points for t in range(FRAMES)])
    column, row = np.moveaxis(np.round(points + true).astype(int), -1, 0)
    within, es = shadow[row, column], FRAMES // 2
    beside = ~within.any(0)
    error, moved = (np.hypot(*np.moveaxis(vectors, -1, 0))[es] for vectors in (displacement - true, true))
    relative = [rms(error[some]) / rms(moved[some]) for some in (beside, within[es])]
    assert relative[0] < 0.02 and relative[1] < 0.03, "without regard to the shadow 3 and 8 %"
    assert quality[es][within[es]].mean() < quality[es][beside].mean() - 0.02

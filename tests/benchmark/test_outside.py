"""The motions and the scores of benchmarks/outside.py."""

import numpy as np
import pytest

from benchmarks import outside

RADIUS = np.linspace(1.0, 1.6, 40)
AROUND = 2 * np.pi * np.arange(90) / 90
WALL = outside.Wall(np.float64(1.0), np.float64(1.6))


def moved(motion):
    """Points (radius, angle, 2) of a wall at end-systole, and where they were."""
    radius, angle = np.meshgrid(RADIUS, AROUND, indexing="ij")
    nodes = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * radius], -1)
    shift = outside.displacement(nodes.reshape(-1, 3), WALL, outside.MOTIONS[motion], 1, np.ones(1))[0]
    return (nodes + shift.reshape(nodes.shape))[..., :2], nodes[..., :2]


def area(place):
    """Area between the first and the last ring of points."""
    x, y = np.moveaxis(place, -1, 0)
    inner, outer = (x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)).sum(1)[[0, -1]] / 2
    return outer - inner


@pytest.mark.parametrize("motion", ["still", "rotation", "twist by layer", "contraction", "dilation"])
def test_area_of_the_wall_is_kept(motion):
    now, before = moved(motion)
    assert area(now) == pytest.approx(area(before), rel=1e-3)


@pytest.mark.parametrize(("motion", "sign"), [("contraction", 1), ("dilation", -1), ("shrinking", -1), ("still", 0)])
def test_sign_of_thickening(motion, sign):
    now, before = moved(motion)
    thicker = np.ptp(np.linalg.norm(now, axis=-1), axis=0) - np.ptp(np.linalg.norm(before, axis=-1), axis=0)
    assert np.all(np.sign(np.round(thicker, 9)) == sign)


def test_sector_does_not_move_or_moves_outwards():
    for motion, sign in (("akinetic sector", 0), ("bulging sector", 1)):
        now, before = moved(motion)
        shift = np.round(np.linalg.norm(now[:, 0], axis=-1) - np.linalg.norm(before[:, 0], axis=-1), 9)
        assert np.all(np.sign(shift) == sign)


def test_scores_of_what_is_found_and_of_a_shift():
    true = np.random.default_rng(1).normal(0, 1e-3, (4, 50, 2))
    unit, quality, radial = 25e-3 / 256, np.full((4, 50), 0.8), (np.full(50, 0.3), np.full(50, 0.1))
    same = outside.scores((true, true), quality, 2, 25e-3, radial)
    assert (same["error_px"], same["right_percent"], same["stated_percent"]) == pytest.approx((0, 100, 80))
    assert same["motion_px"] == pytest.approx(np.sqrt((true[2] ** 2).sum(-1).mean()) / unit)
    shifted = outside.scores((true + [3 * unit, 4 * unit], true), quality, 2, 25e-3, radial)
    assert (shifted["error_px"], shifted["right_percent"]) == pytest.approx((5, 0))
    assert (same["radial_strain_percent"], same["true_radial_strain_percent"]) == pytest.approx((30, 10))
    assert np.isnan(outside.scores((true, true), np.full_like(quality, np.nan), 2, 25e-3, radial)["stated_percent"])

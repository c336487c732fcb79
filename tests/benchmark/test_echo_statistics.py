"""Statistics of echoes of which they are known, and the wall that was drawn in a real one."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.ndimage import gaussian_filter, shift

import echotruth as et
from benchmarks.echo_statistics import Echo, cavity_of, percentiles, statistics

SIDE = 200
DRAWN = Path(__file__).parents[2] / "benchmarks/apical_wall.csv"


def ring():
    """A short axis: wall from 40 to 76 px about the middle."""
    rows, columns = np.indices((SIDE, SIDE)) - SIDE / 2
    reach = np.hypot(rows, columns)
    return (reach > 40) & (reach < 76)


def rayleigh(seed, axial=1.5, lateral=4.0):
    """Envelope of fully developed speckle of a Gaussian cell, mean square 1."""
    random = np.random.default_rng(seed)
    field = [gaussian_filter(random.standard_normal((SIDE, SIDE)), (axial, lateral), mode="wrap") for _ in range(2)]
    power = field[0] ** 2 + field[1] ** 2
    return np.sqrt(power / power.mean())


def compressed(envelope):
    """Grey levels over 60 dB, of which white is four times the root mean square."""
    return np.rint(255 * np.clip(1 + 20 * np.log10(np.maximum(envelope / 4, 1e-6)) / 60, 0, 1)).astype(np.uint8)


def echo(envelopes, **changes):
    wall = np.stack([ring()] * len(envelopes))
    given = {
        "frames": compressed(np.stack(envelopes)),
        "wall": wall,
        "cavity": np.stack([cavity_of(mask) for mask in wall]),
        "scan": np.ones((SIDE, SIDE), bool),
        # So far away that its beams are parallel.
        "probe": (-3000.0, SIDE / 2),
        "free_side": 1,
        "phase": np.arange(len(envelopes)) / len(envelopes),
        "es_phase": 0.4,
        "pairs": [(0, 1)],
    }
    return Echo(**(given | changes))


def test_fully_developed_speckle_has_its_theoretical_statistics():
    found = statistics(echo([rayleigh(seed) for seed in range(6)]))
    assert found["SNR of the envelope"] == pytest.approx(1.913, rel=0.05)
    assert found["Nakagami m"] == pytest.approx(1, rel=0.12)
    assert found["lateral / axial width"] == pytest.approx(4 / 1.5, rel=0.2)
    assert found["lateral width, far / near half"] == pytest.approx(1, abs=0.15)


def test_sparse_bright_spots_are_no_fully_developed_speckle():
    random = np.random.default_rng(1)
    spots = [rayleigh(seed) * gaussian_filter(random.exponential(size=(SIDE, SIDE)) ** 4, 3) / 24 for seed in range(2)]
    found = statistics(echo(spots))
    assert found["Nakagami m"] < 0.75
    assert found["SNR of the envelope"] < 1.8


def test_contrasts_are_those_that_were_put_in():
    wall, rows = ring(), np.indices((SIDE, SIDE))[0]
    inside = cavity_of(wall)
    level = np.where(wall, 1.0, np.where(inside, 10 ** (-12 / 20), 10 ** (8 / 20)))
    dark = wall & (rows < 45)
    level[dark] = 10 ** (-20 / 20)
    both = echo([level, level])
    found = statistics(both)
    share = dark.sum() / wall.sum()
    assert found["wall / blood, dB"] == pytest.approx(12 - 20 * share, abs=0.2)
    assert found["free wall / tissue beyond, dB"] == pytest.approx(-8, abs=0.2)
    assert found["wall as dark as blood, share"] == pytest.approx(share)
    assert percentiles(both)["cavity"] == pytest.approx([compressed(10 ** (-12 / 20))] * 3)


def test_cyclic_variation_and_its_time_are_found():
    phase = np.arange(10) / 10
    # 1.5 dB up and down, least at 0.45 of the cycle, of which end-systole is at 0.4.
    course = -1.5 * np.cos(2 * np.pi * (phase - 0.45))
    found = statistics(echo([10 ** (decibels / 20) * rayleigh(0) for decibels in course], phase=phase))
    expected = 1.5 * (np.cos(2 * np.pi * 0.05) - np.cos(2 * np.pi * 0.45))
    assert found["ED over ES, dB"] == pytest.approx(expected, abs=0.1)
    assert found["time of the minimum / of ES"] == pytest.approx(0.45 / 0.4, abs=0.05)


def test_a_moved_frame_is_followed_and_another_is_not():
    still = rayleigh(3)
    moved = statistics(echo([still, shift(still, (3, -4), mode="grid-wrap", order=1)]))
    other = statistics(echo([still, rayleigh(4)]))
    assert moved["wall, next frame, correlation"] > 0.99
    assert other["wall, next frame, correlation"] < 0.6


def test_the_drawn_wall_is_that_of_a_human_heart_and_brighter_than_its_blood():
    pytest.importorskip("pydicom")
    from pydicom import examples

    clip = et.read_clip(examples.get_path("ybr_color"), spacing_mm=1.02)["image"].values
    table = pd.read_csv(DRAWN, comment="#")
    area = {}
    for frame, points in table.groupby("frame"):
        # The clip has half the pixels of the image in which the wall was drawn.
        parts = [points[points["part"] == part] for part in ("endocardium", "epicardium")]
        borders = [(part[["lateral_px", "axial_px"]].to_numpy(float) + (84.5, 31.5)) / 2 - 0.5 for part in parts]
        wall = et.Wall(*borders, "four_chamber")
        mask = wall.mask(clip.shape[1:])
        cavity = cavity_of(mask)
        area[int(frame)] = cavity.sum() * 1.02**2
        assert 8 < 1.02 * wall.thickness() < 16, "mm"
        assert clip[frame][mask].mean() > 2 * clip[frame][cavity].mean()
    assert area[6] < 0.7 * area[22]
    assert 2500 < area[22] < 5500, "mm2"

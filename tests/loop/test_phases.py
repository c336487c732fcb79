"""Phases of curves whose valves open and close when the formula says, with and without noise."""

import numpy as np
import pytest

from echotruth.loop.phases import CONTRACTION, EJECTION, FILLING, RELAXATION, noise, phases


def beat(frames, opens=0.1, closes=0.45, fills=0.65):
    """Pressure (Pa) and volume (m^3) of a cycle whose valves move at given fractions of it; linear in between."""
    time = np.arange(frames) / frames
    volume = np.interp(time, [0, opens, closes, fills, 1], [50e-9, 50e-9, 20e-9, 20e-9, 50e-9])
    pressure = np.interp(time, [0, opens, closes, fills, 1], [500, 12e3, 13e3, 600, 500])
    return pressure, volume


def ends(phase):
    """Last frame of contraction, ejection and relaxation."""
    return [int(np.flatnonzero(phase == label)[-1]) for label in (CONTRACTION, EJECTION, RELAXATION)]


@pytest.mark.parametrize("frames", [20, 40, 100, 400])
def test_phases_end_where_the_valves_move(frames):
    phase = phases(*beat(frames))
    expected = np.array([0.1, 0.45, 0.65]) * frames
    np.testing.assert_allclose(ends(phase), expected, atol=max(1, 0.01 * frames))
    changes = phase[np.append(True, np.diff(phase.astype(int)) != 0)]
    np.testing.assert_array_equal(changes, [CONTRACTION, EJECTION, RELAXATION, FILLING])
    assert phase.dtype == np.uint8


def test_noise_of_a_catheter_moves_them_by_few_frames():
    pressure, volume = beat(100)
    rng = np.random.default_rng(3)
    for _ in range(50):
        noisy = volume + 0.01 * np.ptp(volume) * rng.normal(size=100)
        last_frames = ends(phases(pressure * (1 + 0.01 * rng.normal(size=100)), noisy))
        np.testing.assert_allclose(last_frames, [10, 45, 65], atol=5)


def test_noise_is_read_off_the_curve():
    rng = np.random.default_rng(5)
    _, volume = beat(2000)
    assert noise(volume) < 1e-12
    assert noise(volume + 3e-10 * rng.normal(size=2000)) == pytest.approx(3e-10, rel=0.1)


def test_a_heart_that_is_only_filled_and_emptied_has_labels_too():
    volume = 40e-9 + 10e-9 * np.cos(2 * np.pi * np.arange(12) / 12)
    phase = phases(volume * 1e10, volume)
    assert phase.shape == (12,) and phase[0] == CONTRACTION
    assert len(phases(np.array([5e2, 1e4]), np.array([50e-9, 20e-9]))) == 2

"""The circulation: against the exact solution of its equations, and its calibration on measured loops."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.config import Loop
from echotruth.config.loop import Circulation as Settings
from echotruth.loop.circulation import Circulation, altered, calibrate
from echotruth.loop.cycle import read_loop
from echotruth.loop.recording import LoopError

MMHG = 133.322387415
SETTINGS = Settings()


def circulation(name="mouse", frames=40):
    return calibrate(read_loop(Loop(file=name, frames=frames)), SETTINGS)


def beat(one: Circulation, pressure):
    """Volumes and arterial pressures of a beat whose cavity pressures (n_frames,) are given, from its frame 0 on."""
    step, arterial, volume = one.period / len(pressure), one.arterial_pressure, 0.0
    volumes, pressures = [volume], [arterial]
    for frame in range(1, len(pressure) + 1):
        passed = one.exchange(pressure[frame % len(pressure)], arterial, frame * step, step)
        arterial, volume = passed.arterial_pressure, volume + passed.volume
        volumes.append(volume)
        pressures.append(arterial)
    return np.array(volumes), np.array(pressures)


def test_arteries_fill_and_empty_exponentially():
    """With the valve open at a constant pressure P_a tends to P R / (R + Z) with the time constant C R Z / (R + Z)."""
    r, z, c, pressure = 3e9, 1e9, 2e-10, 100.0
    none = np.zeros(4)
    one = Circulation(1.0, r, z, 1.0, c, none, none - 1e6, 10.0)
    steps, end = 4000, 0.5
    arterial = one.arterial_pressure
    for k in range(steps):
        arterial = one.exchange(pressure, arterial, end * (k + 1) / steps, end / steps).arterial_pressure
    limit, time_constant = pressure * r / (r + z), c * r * z / (r + z)
    assert arterial == pytest.approx(limit + (10.0 - limit) * np.exp(-end / time_constant), rel=1e-3)
    for k in range(steps):  # and with it shut they empty with R C
        arterial = one.exchange(-1e3, arterial, end * (k + 1) / steps, end / steps).arterial_pressure
    assert arterial < limit
    filled = one.exchange(pressure, 10.0, 0.0, 1e-6)
    assert filled.volume == pytest.approx(-1e-6 * 90.0 / z, rel=1e-3)
    empty = one.exchange(0.0, 50.0, 0.0, 1e-4)
    assert empty.volume == 0
    assert empty.arterial_pressure == pytest.approx(50.0 * np.exp(-1e-4 / (r * c)), rel=1e-6)


def test_slope_is_the_derivative_of_what_passes_the_valves():
    one, _ = circulation()
    shut = 0
    for mmhg in (1.0, 5.0, 40.0, 70.0, 99.0, 130.0):
        for time in (0.0, 0.02, 0.05, 0.11):
            passed, more = (one.exchange(mmhg * MMHG + d, one.arterial_pressure, time, 3e-3) for d in (0.0, 1e-3))
            assert passed.slope <= 0
            assert (more.volume - passed.volume) / 1e-3 == pytest.approx(passed.slope, rel=1e-4, abs=1e-18)
            shut += passed.slope == 0
    assert shut


@pytest.mark.parametrize("frames", [20, 40, 100])
@pytest.mark.parametrize("name", ["mouse", "rat", "human"])
def test_measured_loop_is_given_back(name, frames):
    cycle = read_loop(Loop(file=name, frames=frames))
    one, closed = calibrate(cycle, SETTINGS)
    volumes, arterial = beat(one, cycle.pressure)
    stroke = np.ptp(cycle.volume)
    np.testing.assert_allclose(volumes[:-1], closed.volume - closed.volume[0], atol=1e-9 * stroke)
    assert abs(volumes[-1]) < 1e-9 * stroke
    assert arterial[-1] == pytest.approx(arterial[0])
    if frames >= 40:
        assert np.abs(closed.volume - cycle.volume).max() < 0.02 * stroke
    # What leaves the heart in a beat leaves the arteries: the mean pressure is that of the output through R.
    output = np.ptp(closed.volume) / cycle.period
    assert arterial[1:].mean() == pytest.approx(one.peripheral_resistance * output)


def test_pressures_and_resistances_are_those_of_mammals():
    """Mean arterial pressures of 70 to 110 mmHg; a resistance of some 0.8 to 1.2 mmHg s/mL in people (Westerhof,
    Lankhaar & Westerhof 2009), and as much larger in mice as their output is smaller."""
    for name, low, high in (("mouse", 200.0, 450.0), ("rat", 80.0, 160.0), ("human", 0.6, 1.3)):
        one, cycle = circulation(name)
        assert low < one.peripheral_resistance / MMHG / 1e6 < high
        mean = one.peripheral_resistance * np.ptp(cycle.volume) / cycle.period
        assert 70 < mean / MMHG < 125
        assert one.peripheral_resistance * one.compliance == pytest.approx(2 * one.period)


def test_loop_with_noise_is_calibrated_too():
    cycle = read_loop(Loop(frames=60))
    noisy = cycle.volume + 0.002 * np.ptp(cycle.volume) * np.random.default_rng(3).standard_normal(60)
    noisy[0] = noisy.max()
    one, closed = calibrate(replace(cycle, volume=noisy), SETTINGS)
    volumes, _ = beat(one, cycle.pressure)
    np.testing.assert_allclose(volumes[:-1], closed.volume - closed.volume[0], atol=1e-9 * np.ptp(noisy))
    assert np.abs(closed.volume - noisy).max() < 0.03 * np.ptp(noisy)


def test_larger_heart_has_the_same_pressures():
    one, cycle = circulation()
    small, pressures = beat(one, cycle.pressure)
    large, same = beat(one.scaled(7.0), cycle.pressure)
    np.testing.assert_allclose(large, 7 * small, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(same, pressures)


def test_factors_change_what_they_name():
    one, _ = circulation()
    other = altered(one, Settings(resistance=1.5, compliance=0.5, preload=2.0))
    assert other.peripheral_resistance == 1.5 * one.peripheral_resistance
    assert other.characteristic_resistance == one.characteristic_resistance
    assert other.compliance == 0.5 * one.compliance
    np.testing.assert_array_equal(other.atrial_pressure, 2 * one.atrial_pressure)


def test_settings_without_a_circulation_are_refused():
    with pytest.raises(ValueError, match=r"needs loop.kind = circulation"):
        Loop(circulation={"resistance": 1.2})
    with pytest.raises(ValueError, match=r"must be pressure_volume with loop.kind = circulation"):
        Loop(kind="circulation", prescribed="volume", file="twitch")


def test_loop_of_too_few_frames_is_refused_in_a_sentence():
    for frames in range(2, 12):
        cycle = read_loop(Loop(frames=frames))
        try:
            one, closed = calibrate(cycle, SETTINGS)
        except LoopError as error:
            assert f"mouse.csv: with {frames} frames the loop has none of" in str(error)
            assert frames < 8
        else:
            volumes, _ = beat(one, cycle.pressure)
            np.testing.assert_allclose(
                volumes[:-1], closed.volume - closed.volume[0], atol=1e-9 * np.ptp(closed.volume)
            )

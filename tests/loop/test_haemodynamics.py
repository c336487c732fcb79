"""Times and rates of curves of which they are known exactly."""

import numpy as np
import pytest

from echotruth.config.loop import Loop
from echotruth.loop.cycle import read_loop
from echotruth.loop.haemodynamics import filling_ratio, intervals, pressure_rates
from echotruth.loop.phases import EJECTION, FILLING, phases

PERIOD = 0.12
KNOWN = [(8.2, 55.3, 16.1), (9.5, 49.0, 25.5), (6.0, 60.0, 12.0), (10.9, 45.7, 13.3)]
"""Isovolumic contraction, ejection, isovolumic relaxation, ms."""


def even(u):
    """Share of a volume that has passed after a share of the time, at a flow that rises and falls evenly."""
    u = np.clip(u, 0, 1)
    return np.where(u < 0.5, 2 * u**2, 1 - 2 * (1 - u) ** 2)


def skewed(u):
    """The same at a flow u^0.7 (1 - u): it begins suddenly and ends evenly."""
    u = np.clip(u, 0, 1)
    return 2.7 * u**1.7 - 1.7 * u**2.7


def cycle(known, frames, ejected, filled=even, period=PERIOD):
    """Time, volume and phase of a cycle with known intervals, ms."""
    ivc, ejection, ivr = (1e-3 * duration for duration in known)
    time = period * np.arange(frames) / frames
    closing, opening = ivc + ejection, ivc + ejection + ivr
    volume = 50e-9 - 32e-9 * ejected((time - ivc) / ejection) + 32e-9 * filled((time - opening) / (period - opening))
    pressure = np.where((time >= ivc / 2) & (time <= closing), 13e3, 1e3)
    return time, volume, phases(pressure, volume)


@pytest.mark.parametrize("known", KNOWN)
@pytest.mark.parametrize("frames", [40, 120])
def test_intervals_of_flows_that_rise_and_fall_evenly_are_exact(known, frames):
    found = intervals(*cycle(known, frames, even))
    np.testing.assert_allclose(np.array(found) * 1e3, known, atol=1e-6)
    assert found.tei == pytest.approx((known[0] + known[2]) / known[1])


@pytest.mark.parametrize("known", KNOWN)
@pytest.mark.parametrize("frames", [30, 40, 60, 120])
def test_intervals_of_a_flow_that_begins_suddenly_are_found_within_a_sixth_of_a_frame(known, frames):
    found = np.array(intervals(*cycle(known, frames, skewed))) * 1e3
    np.testing.assert_allclose(found, known, atol=0.5)  # of 3 ms, the step of the default loop


@pytest.mark.parametrize("name", ["mouse", "rat", "human"])
@pytest.mark.parametrize("frames", range(16, 33))
def test_few_frames_of_a_measured_loop_have_the_times_of_many(name, frames):
    """A step of 16 frames is as long as isovolumic contraction, and half of isovolumic relaxation."""
    found, fine = (measured(name, count) for count in (frames, 400))
    np.testing.assert_allclose(found[:3], fine[:3], atol=0.2 * fine[3] / frames)  # a fifth of a step
    assert found[4] == pytest.approx(fine[4], rel=0.05)
    assert found[5] == pytest.approx(fine[5], rel=0.14 if frames < 24 else 0.05)


def measured(name, frames):
    """IVC, ejection, IVR, period, Tei index and tau of a shipped loop."""
    loop = read_loop(Loop(file=name, frames=frames))
    phases_ = intervals(loop.time, loop.volume, phases(loop.pressure, loop.volume))
    tau = pressure_rates(loop.time, loop.pressure, phases_.mitral_opening).tau
    return np.array([*phases_, loop.period, phases_.tei, tau])


@pytest.mark.parametrize("seed", range(10))
def test_a_little_noise_of_the_volume_moves_a_valve_by_less_than_a_frame(seed):
    """Noise of 0.15 % of the stroke volume."""
    time, volume, _ = cycle(KNOWN[0], 40, skewed)
    noisy = volume + np.random.default_rng(seed).normal(0, 0.05e-9, len(volume))
    pressure = np.where((time >= 4e-3) & (time <= 63e-3), 13e3, 1e3)
    np.testing.assert_allclose(np.array(intervals(time, noisy, phases(pressure, noisy))) * 1e3, KNOWN[0], atol=3)


def test_a_loop_without_ejection_or_with_too_few_frames_has_no_times():
    few = intervals(*cycle(KNOWN[0], 8, skewed))
    assert np.isnan([few.ejection, few.ivr, few.tei, few.mitral_opening]).all()
    nothing = np.full(40, np.nan)
    assert np.isnan(intervals(np.arange(40.0), nothing, np.zeros(40, np.uint8))).all()


@pytest.mark.parametrize("frames", [40, 400])
def test_rates_of_a_sinusoid(frames):
    time = PERIOD * np.arange(frames) / frames
    rates = pressure_rates(time, 7e3 - 6e3 * np.cos(2 * np.pi * time / PERIOD), np.nan)
    steepest = 6e3 * 2 * np.pi / PERIOD
    assert rates.dpdt_max == pytest.approx(steepest, rel=1e-4)
    assert rates.dpdt_min == pytest.approx(-steepest, rel=1e-4)
    assert np.isnan(rates.tau)


def test_extreme_rates_lie_between_the_frames():
    time = PERIOD * (np.arange(10)) / 10
    rates = pressure_rates(time, 7e3 - 6e3 * np.cos(2 * np.pi * time / PERIOD + 0.3), np.nan)
    assert rates.dpdt_max == pytest.approx(6e3 * 2 * np.pi / PERIOD, rel=0.01)


@pytest.mark.parametrize("tau", [5e-3, 9e-3, 13e-3])
def test_time_constant_of_an_exponential(tau):
    time = PERIOD * np.arange(40) / 40
    falling = 13e3 * np.exp(-(time - 63e-3) / tau)
    pressure = np.where(time < 30e-3, 1e3 + 12e3 * time / 30e-3, np.where(time < 63e-3, 13e3, falling))
    assert pressure_rates(time, pressure, 80e-3).tau == pytest.approx(tau, rel=0.03)


def test_a_pressure_that_does_not_fall_to_zero_has_no_time_constant():
    time = PERIOD * np.arange(40) / 40
    below = pressure_rates(time, 1e3 * np.cos(2 * np.pi * time / PERIOD), 0.1)
    assert np.isnan(below.tau) and np.isfinite(below.dpdt_min)
    assert np.isnan(pressure_rates(time, np.full(40, np.nan), 0.1)).all()


@pytest.mark.parametrize(("ratio", "apart"), [(1.6, 0.26), (0.7, 0.26), (1.2, 0.2)])
def test_two_waves_of_filling_have_the_ratio_of_their_heights(ratio, apart):
    time = np.arange(60) / 60
    waves = [height * np.exp(-(((time - centre) / 0.06) ** 2)) for height, centre in ((ratio, 0.62), (1, 0.62 + apart))]
    ejection = np.exp(-(((time - 0.2) / 0.06) ** 2))
    rate = sum(waves) - ejection * sum(waves).sum() / ejection.sum()
    phase = np.where(time > 0.42, FILLING, EJECTION)
    assert filling_ratio(time, 1 + np.cumsum(rate) / 60, phase) == pytest.approx(ratio, rel=0.05)


def test_fused_waves_of_filling_and_few_frames_have_no_ratio():
    time, frames = np.arange(60) / 60, slice(None, None, 12)
    wave = np.exp(-(((time - 0.7) / 0.1) ** 2))
    volume, phase = 1 + np.cumsum(wave - wave.mean()) / 60, np.where(time > 0.45, FILLING, EJECTION)
    assert np.isnan(filling_ratio(time, volume, phase))
    assert np.isnan(filling_ratio(time[frames], volume[frames], phase[frames]))

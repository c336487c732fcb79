"""The circulation: against exact solutions of its equations, and its calibration on measured loops."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.config import Loop
from echotruth.config.loop import Circulation as Settings
from echotruth.loop.calibration import AORTIC_DROP, CHAMBERS, calibrate
from echotruth.loop.circulation import (
    ARTERIES,
    LEFT_ATRIUM,
    LEFT_VENTRICLE,
    PULMONARY_ARTERIES,
    RIGHT_ATRIUM,
    RIGHT_VENTRICLE,
    VEINS,
    Cavity,
    altered,
)
from echotruth.loop.cycle import read_loop
from echotruth.loop.recording import LoopError

MMHG = 133.322387415
SETTINGS = Settings(baroreflex=False)


def circulation(name="mouse", frames=40):
    return calibrate(read_loop(Loop(file=name, frames=frames)), SETTINGS)


def beat(one, pressure, volumes=None):
    """Volumes (n_frames + 1, 8), pressures and arterial pressure of a beat with given cavity pressures (n_frames,)."""
    step, volumes = one.period / len(pressure), [one.volumes if volumes is None else volumes]
    pressures, arterial = [], []
    for frame in range(1, len(pressure) + 1):
        passed = one.exchange(volumes[-1], frame * step, step, pressure[frame % len(pressure)])
        volumes.append(passed.volumes)
        pressures.append(passed.pressures)
        arterial.append(passed.arterial_pressure)
    return np.array(volumes), np.array(pressures), np.array(arterial)


def weak(cycle, strength=0.6):
    """A left ventricle of a part of the healthy strength, which fills as the healthy one does."""
    pressure, volume = np.roll(cycle.pressure, -1), np.roll(cycle.volume, -1)
    pressure = np.where(pressure > 15 * MMHG, strength, 1.0) * pressure
    return Cavity(pressure, volume, pressure / volume)


def ring(conductance, elastance):
    """A ring of constant elastances (8,) and conductances (8,)."""
    one, _ = circulation()
    nothing = np.zeros((4, 8))
    return replace(
        one,
        period=1.0,
        elastance=nothing + elastance,
        head=nothing,
        unstressed=np.zeros(8),
        conductance=np.asarray(conductance, float),
    )


def test_arteries_empty_into_veins_as_two_capacities_through_a_resistance():
    """P_1 - P_2 decays with the time constant R C_1 C_2 / (C_1 + C_2), to the pressure of the mean of both."""
    resistance, arterial, venous = 3e9, 2e-10, 5e-9
    conductance = np.zeros(8)
    conductance[ARTERIES] = 1 / resistance
    elastance = np.ones(8)
    elastance[[ARTERIES, VEINS]] = 1 / arterial, 1 / venous
    one, volumes = ring(conductance, elastance), np.zeros(8)
    volumes[[ARTERIES, VEINS]] = 100.0 * arterial, 10.0 * venous
    steps, end = 4000, 0.5
    for k in range(steps):
        passed = one.exchange(volumes, end * (k + 1) / steps, end / steps, 0.0)
        volumes = passed.volumes
    time_constant = resistance * arterial * venous / (arterial + venous)
    difference = passed.pressures[ARTERIES] - passed.pressures[VEINS]
    assert difference == pytest.approx(90.0 * np.exp(-end / time_constant), rel=1e-3)
    mean = (100.0 * arterial + 10.0 * venous) / (arterial + venous)
    later = one.exchange(volumes, 1.0, 1e4, 0.0)
    assert later.pressures[[ARTERIES, VEINS]] == pytest.approx([mean, mean], rel=1e-3)


def test_arteries_fill_through_the_valve_of_a_constant_pressure():
    """P_1 tends to P with the time constant C Z, and the valve lets nothing back."""
    characteristic, compliance, pressure = 1e9, 2e-10, 100.0
    conductance, elastance = np.zeros(8), np.ones(8)
    conductance[LEFT_VENTRICLE], elastance[ARTERIES] = 1 / characteristic, 1 / compliance
    one, volumes = ring(conductance, elastance), np.zeros(8)
    volumes[ARTERIES] = 10.0 * compliance
    steps, end = 4000, 0.3
    for k in range(steps):
        passed = one.exchange(volumes, end * (k + 1) / steps, end / steps, pressure)
        volumes = passed.volumes
    expected = pressure - 90.0 * np.exp(-end / (characteristic * compliance))
    assert passed.pressures[ARTERIES] == pytest.approx(expected, rel=1e-3)
    shut = one.exchange(volumes, 0.31, 0.01, 0.0)
    np.testing.assert_array_equal(shut.volumes, volumes)
    assert shut.slope == 0


def test_slope_and_tangent_are_the_derivatives_of_the_step():
    one, _ = circulation()
    shut = 0
    for mmhg in (1.0, 5.0, 40.0, 70.0, 99.0, 130.0):
        for time in (0.003, 0.02, 0.05, 0.11):
            step = one.volumes, time, 3e-3
            passed, more = (one.exchange(*step, mmhg * MMHG + d) for d in (0.0, 1e-3))
            assert passed.slope <= 0
            difference = (more.volumes - passed.volumes)[LEFT_VENTRICLE] / 1e-3
            assert difference == pytest.approx(passed.slope, rel=1e-4, abs=1e-18)
            shut += passed.slope == 0
            change = 1e-6 * one.stroke_volume * np.array([0.3, -1, 0.5, 0.2, 0.1, -0.4, 0.8, -0.6])
            moved = one.exchange(one.volumes + change, time, 3e-3, mmhg * MMHG)
            np.testing.assert_allclose(
                moved.volumes - passed.volumes, passed.tangent @ change, atol=1e-5 * np.abs(change).max()
            )
    assert shut


@pytest.mark.parametrize("frames", [20, 24, 40, 100])
@pytest.mark.parametrize("name", ["mouse", "rat", "human"])
def test_measured_loop_is_given_back(name, frames):
    cycle = read_loop(Loop(file=name, frames=frames))
    one, closed = calibrate(cycle, SETTINGS)
    volumes, pressures, _ = beat(one, cycle.pressure)
    stroke = np.ptp(cycle.volume)
    np.testing.assert_allclose(volumes[:-1, LEFT_VENTRICLE], closed.volume, atol=1e-9 * stroke)
    np.testing.assert_allclose(volumes[-1], volumes[0], atol=1e-9 * stroke)
    if frames >= 40:
        assert np.abs(closed.volume - cycle.volume).max() < 0.02 * stroke
    # What leaves the heart in a beat leaves the arteries: the mean pressures differ by the output through R.
    output = np.ptp(closed.volume) / cycle.period
    drop = pressures[:, ARTERIES].mean() - pressures[:, VEINS].mean()
    assert drop == pytest.approx(output / one.conductance[ARTERIES])


@pytest.mark.parametrize("name", ["mouse", "rat", "human"])
def test_volume_of_all_is_kept_over_many_beats(name):
    """With pressures of the left ventricle that are not those of the steady beat."""
    one, _ = circulation(name)
    pressure = 0.8 * read_loop(Loop(file=name, frames=40)).pressure
    volumes = one.volumes
    for _ in range(30):
        volumes = beat(one, pressure, volumes)[0][-1]
    assert np.abs(volumes - one.volumes).max() > 0.1 * one.stroke_volume
    assert volumes.sum() == pytest.approx(one.volumes.sum(), rel=1e-13)


@pytest.mark.parametrize("name", ["mouse", "rat", "human"])
def test_pressures_and_resistances_are_those_of_mammals(name):
    """Mean arterial pressures of 70 to 125 mmHg and a resistance of .8 to 1.2 mmHg s/mL in people (Westerhof, Lankhaar
    & Westerhof 2009), larger in mice as their output is smaller; 14 +- 3 mmHg in the pulmonary artery, 0 to 5 in
    the right atrium, 15 to 30 at the height of the right ventricle; a right ventricle that ejects half and more."""
    one, cycle = circulation(name)
    volumes, pressures, _ = beat(one, cycle.pressure)
    mean, highest = pressures.mean(axis=0) / MMHG, pressures.max(axis=0) / MMHG
    low, high = {"mouse": (200.0, 450.0), "rat": (80.0, 160.0), "human": (0.6, 1.3)}[name]
    assert low < 1 / one.conductance[ARTERIES] / MMHG / 1e6 < high
    assert 70 < mean[ARTERIES] < 125
    assert 12 < mean[PULMONARY_ARTERIES] < 17
    assert 2 < mean[RIGHT_ATRIUM] < 4
    assert 6.6 < mean[VEINS] < 8.8
    assert 15 < highest[RIGHT_VENTRICLE] < 30
    right = volumes[:, RIGHT_VENTRICLE]
    assert 0.45 < 1 - right.min() / right.max() < 0.75
    # What the atria leave to the heads is small beside what fills the heart in people.
    assert np.abs(one.head[:, LEFT_ATRIUM]).max() / MMHG < 4


@pytest.mark.parametrize(
    ("name", "systole", "diastole"), [("mouse", (100, 115), (70, 90)), ("human", (105, 130), (70, 90))]
)
def test_arteries_have_the_pressures_of_the_root_of_the_aorta(name, systole, diastole):
    """Below the ventricle by the drop of the valve while it is open, else above it, and pulsating as in life. The
    reflex of the healthy heart keeps its mean."""
    one, cycle = circulation(name)
    volumes, pressures, arterial = beat(one, cycle.pressure)
    flow = -np.diff(volumes[:, LEFT_VENTRICLE]) / (one.period / len(arterial))
    ejects, drop = flow > 1e-9 * flow.max(), pressures[:, LEFT_VENTRICLE] - arterial
    np.testing.assert_allclose(drop[ejects], one.aortic_valve * flow[ejects], atol=1e-9 * arterial.max())
    assert drop[ejects].max() == pytest.approx(AORTIC_DROP * MMHG)
    assert drop[~ejects].max() <= 0
    assert systole[0] < arterial.max() / MMHG < systole[1]
    assert diastole[0] < arterial.min() / MMHG < diastole[1]
    assert arterial.mean() == pytest.approx(one.set_pressure)
    _, steady = one.steady(Cavity(pressures[:, 0], volumes[1:, 0], pressures[:, 0] / volumes[1:, 0]), one.volumes)
    assert steady.mean_arterial_pressure == pytest.approx(one.set_pressure, rel=1e-5)


def test_steady_beat_does_not_depend_on_where_it_begins():
    """Newton's method against hundreds of beats, with a heart of little more than half the strength."""
    one, cycle = circulation()
    cavity = weak(cycle)
    rng = np.random.default_rng(1)
    found = []
    for _ in range(3):
        moved = one.stroke_volume * rng.uniform(-0.4, 0.4, 8)
        found.append(one.steady(cavity, one.volumes + moved - moved.mean())[1].volumes)
    np.testing.assert_allclose(found[1:], [found[0]] * 2, atol=1e-5 * one.stroke_volume)
    step, volumes = one.period / 40, one.volumes
    offset = cavity.pressure - cavity.elastance * cavity.volume
    for _ in range(400):
        for k in range(40):
            volumes = one.exchange(volumes, (k + 1) * step, step, offset[k], cavity.elastance[k]).volumes
    np.testing.assert_allclose(volumes, found[0], atol=1e-5 * one.stroke_volume)
    # The heart that is weak is congested: blood goes from the veins of the body to the lung.
    moved = found[0] - one.volumes
    assert moved[VEINS] < 0 < moved[LEFT_ATRIUM]
    assert moved[LEFT_VENTRICLE] > 0


def test_reflex_defends_the_arterial_pressure():
    one, cycle = circulation()
    cavity, volume = weak(cycle, 0.4), np.roll(cycle.volume, -1)
    _, without = one.steady(cavity, one.volumes)
    answered, defended = replace(one, reflex=True).steady(cavity, one.volumes)
    lost = one.set_pressure - without.mean_arterial_pressure
    assert lost > 5 * MMHG
    assert 0 < one.set_pressure - defended.mean_arterial_pressure < 0.5 * lost
    assert answered.conductance[ARTERIES] < one.conductance[ARTERIES]
    assert answered.unstressed[VEINS] < 0
    assert defended.volumes.sum() == pytest.approx(one.volumes.sum(), rel=1e-9)
    # And leaves the healthy circulation alone.
    healthy = Cavity(np.roll(cycle.pressure, -1), volume, np.roll(cycle.pressure, -1) / volume)
    _, same = replace(one, reflex=True).steady(healthy, one.volumes)
    np.testing.assert_allclose(same.volumes, one.volumes, atol=1e-3 * one.stroke_volume)


def test_chamber_contracts_and_relaxes_as_a_cosine():
    chamber = CHAMBERS[RIGHT_VENTRICLE]
    at = np.array([0.0, chamber.contraction, chamber.contraction + chamber.relaxation / 2, 0.9])
    height = [0, 1, 0.5, 0]
    np.testing.assert_allclose(chamber.elastance(at), chamber.passive + chamber.active * np.array(height), atol=1e-12)


def test_loop_with_noise_is_calibrated_too():
    cycle = read_loop(Loop(frames=60))
    noisy = cycle.volume + 0.002 * np.ptp(cycle.volume) * np.random.default_rng(3).standard_normal(60)
    noisy[0] = noisy.max()
    one, closed = calibrate(replace(cycle, volume=noisy), SETTINGS)
    volumes, _, _ = beat(one, cycle.pressure)
    np.testing.assert_allclose(volumes[:-1, 0], closed.volume, atol=1e-9 * np.ptp(noisy))
    assert np.abs(closed.volume - noisy).max() < 0.03 * np.ptp(noisy)


def test_larger_heart_has_the_same_pressures():
    one, cycle = circulation()
    small, pressures, _ = beat(one, cycle.pressure)
    large, same, _ = beat(one.scaled(7.0), cycle.pressure)
    np.testing.assert_allclose(large, 7 * small, rtol=1e-12)
    np.testing.assert_allclose(same, pressures, rtol=1e-9)


def test_factors_change_what_they_name():
    one, _ = circulation()
    other = altered(one, Settings(resistance=1.5, compliance=0.5, retained_volume_stroke_volumes=2.0))
    assert one.conductance[ARTERIES] == pytest.approx(1.5 * other.conductance[ARTERIES])
    np.testing.assert_array_equal(np.delete(other.conductance, ARTERIES), np.delete(one.conductance, ARTERIES))
    np.testing.assert_array_equal(other.elastance[:, ARTERIES], 2 * one.elastance[:, ARTERIES])
    assert other.volumes.sum() - one.volumes.sum() == pytest.approx(2 * one.stroke_volume)
    assert other.reflex
    assert not altered(one, SETTINGS).reflex


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
            volumes, _, _ = beat(one, cycle.pressure)
            np.testing.assert_allclose(volumes[:-1, 0], closed.volume, atol=1e-9 * np.ptp(closed.volume))

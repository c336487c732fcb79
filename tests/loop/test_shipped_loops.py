"""The shipped loops: rows against the formulas at their heads, and times and rates against published ranges."""

import numpy as np
import pytest

from echotruth.loop.cycle import SHIPPED

LOOPS = ("mouse", "rat", "human")


def rows(name):
    """Time (ms), pressure (mmHg) and volume (uL or mL), read without the package."""
    lines = (SHIPPED / f"{name}.csv").read_text().splitlines()
    return np.loadtxt([line for line in lines if not line.startswith("#")][1:], delimiter=",").T


def valves(time, volume):
    """Times at which the aortic valve opens and closes and the mitral valve opens: the middle between two rows."""
    full, empty = volume == volume[0], volume == volume.min()
    opens, closes, fills = np.argmin(full), np.argmax(empty), np.flatnonzero(empty)[-1] + 1
    return [(time[row - 1] + time[row]) / 2 for row in (opens, closes, fills)]


def intervals(name):
    """Isovolumic contraction, ejection and isovolumic relaxation, ms; to within a step of time."""
    time, _, volume = rows(name)
    opens, closes, fills = valves(time, volume)
    return opens, closes - opens, fills - closes


def relaxation(name, skipped=0):
    """Time and pressure from dP/dt min, or some rows after it, up to the opening of the mitral valve."""
    time, pressure, volume = rows(name)
    falling = slice(np.argmin(np.gradient(pressure, time)) + skipped, np.searchsorted(time, valves(time, volume)[2]))
    return time[falling], pressure[falling]


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("mouse", 0.37, 0.50),  # 0.44 +- 0.07, J Am Soc Echocardiogr 16 (2003) 814; 0.50 is the less of two bounds
        ("rat", 0.40, 0.48),  # 0.44 +- 0.04, PubMed 20562113
        ("human", 0.34, 0.44),  # 0.39 +- 0.05, Tei et al. 1995
    ],
)
def test_tei_index_is_that_of_healthy_hearts_by_doppler(name, low, high):
    contraction, ejection, relaxation = intervals(name)
    assert low <= (contraction + relaxation) / ejection <= high


def test_times_of_the_adult_are_within_the_normal_ranges_of_a_population():
    """95 % of healthy people of the Copenhagen City Heart Study, doi 10.1007/s00392-023-02269-2."""
    for duration, (low, high) in zip(intervals("human"), ((20, 59), (248, 336), (59, 134)), strict=True):
        assert low <= duration <= high


@pytest.mark.parametrize(
    ("name", "rise", "fall"),
    [
        ("mouse", (8_200, 14_200), (6_700, 10_500)),  # PMC10441126, table 4
        ("rat", (7_600, 13_100), (6_700, 7_200)),  # doi 10.1038/nprot.2008.138; Juneman et al. 2013
        ("human", (1_550, 1_620), (1_940, 2_020)),  # 1 584 and 1 979 in Cardiol Res Pract (2011) 692862
    ],
)
def test_pressure_rises_and_falls_as_fast_as_in_catheterised_hearts(name, rise, fall):
    time, pressure, _ = rows(name)
    rate = 1000 * np.diff(pressure) / np.diff(time)
    assert rise[0] <= rate.max() <= rise[1]
    assert fall[0] <= -rate.min() <= fall[1]


@pytest.mark.parametrize(
    ("name", "constant", "low", "high"),
    [
        ("mouse", 8.5, 7.0, 12.0),  # PMC10441126, table 4
        ("rat", 13.6, 13.5, 13.9),  # 13.6-13.9 ms, Juneman et al. 2013
        ("human", 45.0, 44.0, 46.0),  # 45 ms, Cardiol Res Pract (2011) 692862
    ],
)
def test_pressure_relaxes_with_its_time_constant_towards_its_asymptote(name, constant, low, high):
    """The regression of dP/dt on P leaves the asymptote free (Raff & Glantz, Circ Res 48 (1981) 813)."""
    time, pressure = relaxation(name, skipped=2)
    measured = -1 / np.polyfit(pressure[1:-1], np.gradient(pressure, time)[1:-1], 1)[0]
    assert measured == pytest.approx(constant, rel=0.01)
    assert low <= measured <= high


@pytest.mark.parametrize(("name", "constant"), [("mouse", 7.5), ("rat", 10.8), ("human", 36.0)])
def test_a_fit_towards_zero_gives_the_shorter_time_constant_at_the_head(name, constant):
    time, pressure = relaxation(name)
    assert -1 / np.polyfit(time, np.log(pressure), 1)[0] == pytest.approx(constant, rel=0.02)


@pytest.mark.parametrize("name", LOOPS)
def test_end_systole_is_at_the_end_of_ejection(name):
    """The elastance is largest before the aortic valve closes, by less than a fiftieth of the beat."""
    time, pressure, volume = rows(name)
    closes = valves(time, volume)[1]
    assert closes - 0.02 * time[-1] <= time[np.argmax(pressure / volume)] <= closes


@pytest.mark.parametrize(("name", "slack", "edp"), [("mouse", 32.8, 4), ("rat", 140, 4), ("human", 75, 7)])
def test_pressure_in_filling_exceeds_that_of_the_passive_wall(name, slack, edp):
    """A pressure below it would need a wall that pushes itself apart: a negative active tension."""
    time, pressure, volume = rows(name)
    share = np.maximum(volume - slack, 0) / (volume[0] - slack)
    passive = edp * share * (1.2414 - 0.4625 * share + 0.2211 * share**2)
    assert np.all(pressure >= passive - 0.001)
    assert np.all(pressure[time > time[-1] / 2] > 1)


@pytest.mark.parametrize("name", LOOPS)
def test_early_filling_is_the_faster_wave_and_atrial_filling_the_second(name):
    time, _, volume = rows(name)
    flow = np.gradient(volume, time) * (time > valves(time, volume)[2])
    tops = np.flatnonzero((flow[1:-1] > flow[:-2]) & (flow[1:-1] >= flow[2:])) + 1
    assert len(tops) == 2
    assert 1 < flow[tops[0]] / flow[tops[1]] < 2.5

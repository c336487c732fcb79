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


def step(u):
    return np.clip(u, 0, 1) ** 3 * (10 - 15 * np.clip(u, 0, 1) + 6 * np.clip(u, 0, 1) ** 2)


def flow(u):
    return 2.7 * np.clip(u, 0, 1) ** 1.7 - 1.7 * np.clip(u, 0, 1) ** 2.7


def fall(u):
    v = np.clip(u, 0, 1)
    return np.where(u > 1, u - 0.5, 2.5 * v**4 - 3 * v**5 + v**6)


def passive(edp, y):
    x = 0.1 * np.log1p(np.exp(10 * y))
    return edp * x * (1.2414 - 0.4625 * x + 0.2211 * x**2)


def mouse(t):
    volume = 50 - 32 * flow((t - 8.2) / 55.3) + 22.4 * flow((t - 79.6) / 26) + 9.6 * step((t - 100) / 20)
    contraction = 4 + 101.5 * (1 - np.exp(-((t / 7.5) ** 2))) - 6 * step((t - 8.2) / 55.3)
    asymptote = -4 * (1 - step((t - 79.6) / 14))
    pressure = asymptote + (contraction + 4) * np.exp(-4.5 / 8.5 * fall((t - 61.5) / 4.5))
    wall = step((t - 63.5) / 16.1) * passive(4, (volume - 32.8) / 17.2)
    return pressure * (1 - step((t - 92) / 28)) + wall, volume


def rat(t):
    volume = 230 - 150 * flow((t - 12) / 86) + 111 * flow((t - 123.5) / 24) + 39 * step((t - 138) / 22)

    def relaxing(t):
        contraction = 4 + 127 * (1 - np.exp(-((t / 11.2) ** 2))) - 7 * step((t - 12) / 86)
        return -9 + (contraction + 9) * np.exp(-12 / 13.6 * fall((t - 93) / 12))

    q = relaxing(123.5)
    after = q * np.exp(-(np.maximum(t, 123.5) - 123.5) * (q + 9) / (13.6 * q)) * (1 - step((t - 135) / 25))
    pressure = np.where(t <= 123.5, relaxing(t), after)
    return pressure + step((t - 98) / 25.5) * passive(4, (volume - 140) / 90), volume


def human(t):
    volume = 150 - 100 * flow((t - 46) / 300) + 75 * flow((t - 428) / 190) + 25 * step((t - 670) / 130)

    def relaxing(t):
        contraction = 7 + 114.5 * (1 - np.exp(-((t / 54) ** 1.5))) - 6 * step((t - 46) / 300)
        return -8 + (contraction + 8) * np.exp(-40 / 45 * fall((t - 326) / 40))

    q = relaxing(428)
    after = q * np.exp(-(np.maximum(t, 428) - 428) * (q + 8) / (45 * q)) * (1 - step((t - 600) / 200))
    pressure = np.where(t <= 428, relaxing(t), after)
    return pressure + step((t - 346) / 82) * passive(7, (volume - 75) / 75), volume


@pytest.mark.parametrize(("name", "formula"), [("mouse", mouse), ("rat", rat), ("human", human)])
def test_rows_follow_from_the_formulas_at_their_head(name, formula):
    time, pressure, volume = rows(name)
    expected = formula(time)
    np.testing.assert_allclose(pressure, expected[0], atol=0.00051)
    np.testing.assert_allclose(volume, expected[1], atol=0.00051)


@pytest.mark.parametrize(("name", "formula"), [("mouse", mouse), ("rat", rat), ("human", human)])
def test_pressure_and_volume_have_no_step_and_no_corner(name, formula):
    """The largest change of slope vanishes with the step: to 1/4 for a slope that begins as the root of time, at most.

    At a corner it would stay, and at a jump it would grow.
    """
    period, changes = rows(name)[0][-1], []
    for steps in (4000, 64000):
        curves = np.array([curve / np.ptp(curve) for curve in formula(np.linspace(0, period, steps + 1))])
        changes.append(np.abs(np.diff(curves, 2)).max(axis=1) * steps)
    assert np.all(changes[1] < 0.26 * changes[0])

"""Hearts in a circulation: the healthy one gives its loop back, and changed ones change as in life."""

import warnings

import numpy as np
import pytest

from echotruth.config import Config, Physiology
from echotruth.heart import Heart
from echotruth.loop.cycle import read_loop
from echotruth.loop.phases import CONTRACTION
from echotruth.mechanics.beat import beat
from echotruth.mechanics.bounds import violation
from echotruth.mechanics.derived import centroid_kinematics
from echotruth.mechanics.physiology import measured_heart
from echotruth.mechanics.solver import circulation as solver
from echotruth.mechanics.solver.newton import Diverged
from echotruth.notebook import simulation

COARSE = {"circumferential_elements": 6, "longitudinal_elements": 4, "transmural_elements": 1}
BLOCKED = {"circumferential_elements": 12, "longitudinal_elements": 6}


def heart(frames=12, geometry=None, pathology=None, **factors):
    return Config(
        geometry=COARSE | (geometry or {}),
        pathology=pathology or {},
        loop={"kind": "circulation", "frames": frames, "circulation": factors},
    )


def measured(config):
    arrays = beat(config)
    return arrays["mechanics"], measured_heart(arrays, config)[0]


@pytest.fixture(scope="module")
def healthy():
    return beat(heart(frames=40))


def test_healthy_heart_gives_its_loop_back(healthy):
    cycle, mechanics = read_loop(heart(frames=40).loop), healthy["mechanics"]
    assert np.abs(mechanics["pressure"] - cycle.pressure).max() < 0.005 * cycle.pressure.max()
    assert np.abs(mechanics["volume"] - cycle.volume).max() < 0.005 * np.ptp(cycle.volume)
    assert np.isnan(mechanics["pressure_target"]).all()
    assert np.isfinite(mechanics["arterial_pressure"]).all()
    assert mechanics["residual"].max() < 1e-8


def test_heart_moves_as_in_the_measured_loop(healthy):
    config = heart(frames=40)
    same = beat(config.model_copy(update={"loop": config.loop.model_copy(update={"kind": "measured"})}))
    moved = same["mechanics"]["displacement"]
    difference = np.abs(healthy["mechanics"]["displacement"] - moved).max()
    assert difference < 0.02 * np.abs(moved).max()
    assert np.isnan(same["mechanics"]["arterial_pressure"]).all()


@pytest.mark.slow
def test_changed_hearts_change_as_in_life(healthy):
    curves, fraction = healthy["mechanics"], measured_heart(healthy, heart(40))[0]["ejection_fraction"]

    weak, found = measured(heart(contractility=0.6))
    assert found["ejection_fraction"] < fraction - 0.08
    assert weak["pressure"].max() < curves["pressure"].max()
    np.testing.assert_allclose(weak["stiffness"], curves["stiffness"])

    loaded, found = measured(heart(resistance=1.5))
    assert found["ejection_fraction"] < fraction - 0.04
    assert loaded["pressure"].max() > 1.05 * curves["pressure"].max()

    # Frank and Starling: what fills more ejects more, though not a larger part.
    full, found = measured(heart(preload=2.0))
    assert full["volume"][0] > 1.15 * curves["volume"][0]
    assert np.ptp(full["volume"]) > 1.1 * np.ptp(curves["volume"])
    assert found["ejection_fraction"] < fraction

    scarred, found = measured(heart(pathology={"infarct": {"segments": [7, 8, 12, 13, 14]}}))
    assert found["ejection_fraction"] < fraction - 0.1
    np.testing.assert_allclose(scarred["stiffness"], curves["stiffness"])

    dilated, found = measured(heart(geometry={"dilation": 1.2}, contractility=0.5))
    assert found["ejection_fraction"] < 0.4
    assert dilated["volume"][0] > 1.5 * curves["volume"][0]


@pytest.mark.slow
def test_late_wall_stretches_the_septum_again(healthy):
    """Left bundle branch block: the septum shortens at once and stretches the lateral wall, which overtakes it then and
    stretches it in turn; the heart ejects less and twists less."""
    config = heart(frames=40, geometry=BLOCKED, pathology={"activation": {"preset": "lbbb"}})
    arrays = beat(config)
    curves, found = arrays["mechanics"], measured_heart(arrays, config)[0]
    normal = measured(heart(frames=40, geometry=BLOCKED))[1]
    es = int(curves["es_frame"])
    strain = centroid_kinematics(Heart.of(arrays, config))["strain"][..., 1]
    segment = arrays["fibres"]["segment"]
    septal, lateral = (strain[:, np.isin(segment, w)].mean(axis=1) for w in ((2, 3, 8, 9, 14), (5, 6, 11, 12, 16)))
    assert lateral[:es].max() > 0.05
    assert septal[:es].max() < 0.02
    assert (septal - np.minimum.accumulate(septal))[:es].max() > 0.02  # rebound stretch
    assert septal[es] - lateral[es] > 0.01
    assert found["ejection_fraction"] < normal["ejection_fraction"] - 0.05
    assert found["twist_es"] < normal["twist_es"] - np.radians(1)


@pytest.mark.slow
@pytest.mark.parametrize("age", ["fresh", "old"])
def test_infarct_hardly_bulges_and_the_wall_away_from_it_shortens_less(age):
    """As in mice after a day (Epstein 2002), whose ejection fraction falls and whose remote wall weakens."""
    normal = beat(heart(frames=24, geometry=BLOCKED))
    infarct = {"segments": [7, 8, 12, 13, 14], "age": age}
    config = heart(frames=24, geometry=BLOCKED, pathology={"infarct": infarct})
    arrays = beat(config)
    curves, region = arrays["mechanics"], arrays["pathology"]["region"]
    es, ivc = int(curves["es_frame"]), np.flatnonzero(curves["phase"] == CONTRACTION)[-1]
    strain = arrays["kinematics"]["strain"][..., 1].astype(float)
    scar = strain[:, region == 1].mean(axis=1)
    assert scar[ivc] < 0.04 and -0.02 < scar[es] < 0.03
    healthy = normal["kinematics"]["strain"][int(normal["mechanics"]["es_frame"])][:, 1][region == 0].mean()
    assert -0.16 < healthy < strain[es, region == 0].mean()
    fractions = [1 - volume.min() / volume[0] for volume in (normal["mechanics"]["volume"], curves["volume"])]
    assert fractions[1] < fractions[0] - 0.14
    assert curves["pressure"][0] > normal["mechanics"]["pressure"][0]


@pytest.mark.slow
def test_steady_beat_does_not_depend_on_how_the_arteries_are_hastened(monkeypatch):
    hastened, _ = measured(heart(frames=12, resistance=1.15, beats_max=40))
    monkeypatch.setattr(solver, "STEADY", 5e-4)
    monkeypatch.setattr(solver, "_hastened", lambda circulation, first, last: last)
    natural, _ = measured(heart(frames=12, resistance=1.15, beats_max=40))
    for name in ("pressure", "volume", "arterial_pressure"):
        assert np.abs(hastened[name] - natural[name]).max() < 0.01 * np.abs(natural[name]).max()


def test_heart_that_is_not_steady_in_time_is_refused():
    with pytest.raises(Diverged, match=r"not steady after 1 beats .*raise loop.circulation.beats_max"):
        beat(heart(frames=12, resistance=1.5, beats_max=1))


def test_bounds_of_healthy_hearts_are_not_asked_of_changed_ones(healthy):
    assert "circumferential_strain_min" in measured_heart(healthy, heart(40))[1]
    assert "circumferential_strain_min" not in measured_heart(healthy, heart(40, contractility=0.6))[1]
    assert "circumferential_strain_min" not in measured_heart(healthy, heart(40, geometry={"hypertrophy": 1.2}))[1]


@pytest.mark.parametrize("contractility", [1.0, 0.6])
def test_notebook_and_workflow_judge_a_heart_alike(healthy, monkeypatch, contractility):
    """The bounds of healthy hearts, here one that none meets, are asked of those that differ in nothing."""
    monkeypatch.setattr(simulation, "simulate", lambda config: dict(healthy))
    config = heart(40, contractility=contractility)
    config = config.model_copy(update={"physiology": Physiology(circumferential_strain_min=-0.08)})
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        simulation.beat(config, progress=False)
    reason = violation(measured_heart(healthy, config)[1], config.physiology)
    assert bool(reason) == (contractility == 1)
    assert [str(each.message) for each in told] == [f"implausible heart: {reason}"] * bool(reason)

"""Hearts in a circulation: the healthy one gives its loop back, and changed ones change as in life."""

import warnings
from functools import cache

import numpy as np
import pytest

from echotruth.config import Config
from echotruth.config.diagnosis import BOUNDS_OF, bounds_of
from echotruth.heart import Heart
from echotruth.loop.calibration import calibrate
from echotruth.loop.circulation import ARTERIES, LEFT_VENTRICLE
from echotruth.loop.cycle import read_loop
from echotruth.loop.phases import CONTRACTION
from echotruth.mechanics.beat import beat
from echotruth.mechanics.bounds import violation
from echotruth.mechanics.derived import centroid_kinematics
from echotruth.mechanics.physiology import measured_heart
from echotruth.mechanics.solver import circulation as solver
from echotruth.mechanics.solver.newton import Diverged, LoadStepper
from echotruth.notebook import simulation
from echotruth.repository import schema
from validation.heart import stored_heart
from validation.work import residual

MMHG = 133.322387415
COARSE = {"circumferential_elements": 6, "longitudinal_elements": 4, "transmural_elements": 1}
BLOCKED = {"circumferential_elements": 12, "longitudinal_elements": 4}
"""Of a heart whose walls are told apart."""


def heart(frames=12, geometry=None, pathology=None, **factors):
    return Config(
        geometry=COARSE | (geometry or {}),
        pathology=pathology or {},
        mechanics={"hold": "base"},
        loop={"kind": "circulation", "frames": frames, "circulation": factors},
    )


def measured(config):
    arrays = beat(config)
    return arrays["mechanics"], measured_heart(arrays, config)[0]


def assert_valve_is_healthy(mechanics):
    """Blood passes the aortic valve at less than 1.4 m/s, 4 v^2 = 8 mmHg: up to 1.5 m/s are normal in people (ACC/AHA
    guidelines 2006, J Am Coll Cardiol 48, e1)."""
    drop = (mechanics["pressure"] - mechanics["arterial_pressure"]) / MMHG
    assert 1 < drop.max() < 8
    assert mechanics["pressure"].max() - mechanics["arterial_pressure"].max() < 8 * MMHG
    assert mechanics["arterial_pressure"].min() > 0.5 * mechanics["arterial_pressure"].max()


SEGMENTS = [7, 8, 12, 13, 14]
DISEASES = {
    "healthy": {},
    "old": {"pathology": {"infarct": {"segments": SEGMENTS, "age": "old"}}},
    "lbbb": {"pathology": {"activation": {"preset": "lbbb"}}},
    "dcm": {"pathology": {"preset": "dcm"}},
    "hypertension": {"pathology": {"preset": "hypertension"}},
}


@cache
def diseased(disease, species):
    """Configuration, arrays, measures and judged values of a heart."""
    config = heart(16, {"preset": species} | (BLOCKED if disease == "lbbb" else {}), **DISEASES[disease])
    arrays = beat(config)
    return config, arrays, *measured_heart(arrays, config)


@pytest.fixture(scope="module")
def weak():
    """Configuration and arrays."""
    config = heart(contractility=0.6)
    return config, beat(config)


@pytest.fixture(scope="module")
def healthy():
    return beat(heart(frames=40))


def test_healthy_heart_gives_its_loop_back(healthy):
    cycle, mechanics = read_loop(heart(frames=40).loop), healthy["mechanics"]
    assert_valve_is_healthy(mechanics)
    assert np.abs(mechanics["pressure"] - cycle.pressure).max() < 0.005 * cycle.pressure.max()
    assert np.abs(mechanics["volume"] - cycle.volume).max() < 0.005 * np.ptp(cycle.volume)
    assert np.isnan(mechanics["pressure_target"]).all()
    assert mechanics["residual"].max() < 1e-8


def test_stored_compartments_are_those_of_a_closed_circulation(healthy):
    """Their volumes add up to the same in every frame, and the first of them is the left ventricle."""
    mechanics = healthy["mechanics"]
    volume, pressure = mechanics["compartment_volume"], mechanics["compartment_pressure"]
    np.testing.assert_allclose(volume.sum(axis=1), volume[0].sum(), rtol=1e-12)
    np.testing.assert_allclose(volume[:, LEFT_VENTRICLE], mechanics["volume"], rtol=1e-7)
    np.testing.assert_array_equal(pressure[:, LEFT_VENTRICLE], mechanics["pressure"])
    compliance = volume[:, ARTERIES] / pressure[:, ARTERIES]
    np.testing.assert_allclose(compliance, compliance[0], rtol=1e-12)
    assert set(schema.LABELS["compartment"]) >= {"left_ventricle", "systemic_arteries"}
    assert volume.shape == (40, len(schema.LABELS["compartment"]))


def test_heart_moves_as_in_the_measured_loop(healthy):
    config = heart(frames=40)
    same = beat(config.model_copy(update={"loop": config.loop.model_copy(update={"kind": "measured"})}))
    moved = same["mechanics"]["displacement"]
    difference = np.abs(healthy["mechanics"]["displacement"] - moved).max()
    assert difference < 0.02 * np.abs(moved).max()
    for name in ("arterial_pressure", "compartment_pressure", "compartment_volume"):
        assert np.isnan(same["mechanics"][name]).all()
        assert same["mechanics"][name].shape == healthy["mechanics"][name].shape
    # The cells of a healthy heart bear T_Ca by their contractility, in the loop and, as their lengths are, out of it.
    for arrays, tolerance in ((same, 1e-6), (healthy, 0.03)):
        mechanics = arrays["mechanics"]
        expected = mechanics["active_tension"][:, None] * arrays["pathology"]["tension_scale"]
        assert np.abs(mechanics["cell_tension"] - expected).max() < tolerance * expected.max()


@pytest.mark.slow
def test_changed_hearts_change_as_in_life(healthy, weak):
    curves, fraction = healthy["mechanics"], measured_heart(healthy, heart(40))[0]["ejection_fraction"]

    # A failing heart is congested: it fills more at a higher pressure, and ejects less.
    config, arrays = weak
    failing, found = arrays["mechanics"], measured_heart(arrays, config)[0]
    assert found["ejection_fraction"] < fraction - 0.1
    assert failing["volume"][0] > 1.1 * curves["volume"][0]
    assert failing["pressure"][0] > 1.5 * curves["pressure"][0]
    assert np.ptp(failing["volume"]) < np.ptp(curves["volume"])
    assert failing["arterial_pressure"].mean() < curves["arterial_pressure"].mean()
    np.testing.assert_allclose(failing["stiffness"], curves["stiffness"])

    loaded, found = measured(heart(resistance=1.5, baroreflex=False))
    assert found["ejection_fraction"] < fraction - 0.02
    assert loaded["pressure"].max() > 1.1 * curves["pressure"].max()

    # Frank and Starling: what fills more ejects more, though not a larger part.
    full, found = measured(heart(retained_volume_stroke_volumes=5.0))
    assert full["volume"][0] > 1.1 * curves["volume"][0]
    assert np.ptp(full["volume"]) > 1.05 * np.ptp(curves["volume"])


@pytest.mark.slow
@pytest.mark.parametrize(("species", "disease"), [("mouse", "old"), ("mouse", "lbbb"), ("human", "dcm")])
def test_heart_is_within_the_bounds_of_its_diagnosis(species, disease):
    config, arrays, _, values = diseased(disease, species)
    assert violation(values, bounds_of(config)) == ""
    assert_valve_is_healthy(arrays["mechanics"])
    # Nor is it that of a healthy heart.
    assert violation(values, config.physiology)


@pytest.mark.parametrize(
    "disease", ["dcm", *(pytest.param(each, marks=pytest.mark.slow) for each in ("hypertension", "old", "lbbb"))]
)
def test_stored_arrays_are_in_balance(disease):
    """Force of every frame by energies written down anew: the pericardium and taut scars rest at frame 0."""
    config, arrays, _, _ = diseased(disease, "mouse")
    assert residual(stored_heart(config, arrays["mechanics"])).max() < 1e-5


@pytest.mark.slow
def test_grown_hearts_are_those_of_their_disease():
    """Concentric growth: end-systolic pressure and wall rise, EF is kept, GLS falls. Eccentric growth: wide, weak and
    congested, with what moves before ejection small."""
    hearts = [diseased(disease, "mouse") for disease in ("healthy", "hypertension", "dcm")]
    before, pressed, dilated = (arrays["mechanics"] for _, arrays, _, _ in hearts)
    sound, thick, wide = (found for _, _, found, _ in hearts)
    es = [one["pressure"][int(one["es_frame"])] for one in (before, pressed)]
    assert 1.2 < es[1] / es[0] < 1.45
    assert abs(thick["ejection_fraction"] - sound["ejection_fraction"]) < 0.05
    assert sound["gls"] + 0.005 < thick["gls"] < 0
    assert 0.2 < wide["ejection_fraction"] < 0.35
    assert dilated["volume"][0] > 1.6 * before["volume"][0]
    assert dilated["pressure"][0] > 10 * MMHG
    assert np.ptp(dilated["volume"]) < np.ptp(before["volume"])
    assert np.abs(wide["level_strain_ivc"][:, 1]).max() < 0.03


@pytest.mark.slow
def test_late_wall_is_stretched_and_overtakes_the_septum():
    """Left bundle branch block: the septum shortens at once and stretches the lateral wall, which overtakes it then;
    the heart ejects less and twists less."""
    config, arrays, found, _ = diseased("lbbb", "mouse")
    normal = diseased("healthy", "mouse")[2]
    es = int(arrays["mechanics"]["es_frame"])
    strain = centroid_kinematics(Heart.of(arrays, config))["strain"][..., 1]
    segment = arrays["fibres"]["segment"]
    septal, lateral = (strain[:, np.isin(segment, w)].mean(axis=1) for w in ((2, 3, 8, 9, 14), (5, 6, 11, 12, 16)))
    assert lateral[:es].max() > 0.05
    assert septal[:es].max() < 0.02
    assert septal[es] - lateral[es] > 0.01
    assert found["ejection_fraction"] < normal["ejection_fraction"] - 0.05
    assert found["twist_es"] < normal["twist_es"] - np.radians(1)


@pytest.mark.slow
def test_infarct_hardly_bulges_and_the_wall_away_from_it_shortens_less():
    """As in mice after a day (Epstein 2002), whose ejection fraction falls and whose remote wall weakens."""
    _, normal, _, _ = diseased("healthy", "mouse")
    _, arrays, _, _ = diseased("old", "mouse")
    curves, region = arrays["mechanics"], arrays["pathology"]["region"]
    es, ivc = int(curves["es_frame"]), np.flatnonzero(curves["phase"] == CONTRACTION)[-1]
    strain = arrays["kinematics"]["strain"][..., 1].astype(float)
    scar = strain[:, region == 1].mean(axis=1)
    assert scar[ivc] < 0.04 and -0.02 < scar[es] < 0.03
    healthy = normal["kinematics"]["strain"][int(normal["mechanics"]["es_frame"])][:, 1][region == 0].mean()
    assert -0.16 < healthy < strain[es, region == 0].mean()
    fractions = [1 - volume.min() / volume[0] for volume in (normal["mechanics"]["volume"], curves["volume"])]
    assert fractions[1] < fractions[0] - 0.14
    assert curves["pressure"][0] > 1.5 * normal["mechanics"]["pressure"][0]
    assert curves["volume"][0] > normal["mechanics"]["volume"][0]
    np.testing.assert_allclose(curves["stiffness"], normal["mechanics"]["stiffness"])


@pytest.mark.slow
def test_steady_beat_does_not_depend_on_how_it_is_sought(monkeypatch):
    """Not on the elastance between the beats, nor on how near the rough ones come: this one is thrice as stiff."""
    config = heart(frames=8, contractility=0.8, beats_max=40)
    monkeypatch.setattr(solver, "STEADY", 1e-3)
    found, _ = measured(config)
    monkeypatch.setattr(solver, "ROUGH_TOLERANCE", 1e-8)
    stiff = solver.elastance
    monkeypatch.setattr(
        solver, "elastance", lambda *args: (one := stiff(*args[:3]))._replace(elastance=3 * one.elastance)
    )
    other, _ = measured(config)
    for name in ("pressure", "volume", "arterial_pressure"):
        assert np.abs(found[name] - other[name]).max() < 0.005 * np.abs(other[name]).max()


def test_blood_is_kept_from_beat_to_beat(monkeypatch):
    """What the compartments hold at the beginning of each beat, and the heart within it, to round-off."""
    begun, retained = [], 3.0
    couple = LoadStepper.couple

    def recorded(stepper, circulation, volumes):
        begun.append((volumes.sum(), stepper.equations.volume(stepper.state), volumes[0]))
        couple(stepper, circulation, volumes)

    monkeypatch.setattr(LoadStepper, "couple", recorded)
    config = heart(frames=8, contractility=0.7, retained_volume_stroke_volumes=retained)
    measured(config)
    cycle = read_loop(config.loop)
    calibrated, _ = calibrate(cycle, config.loop.circulation)
    totals, filled, given = np.array(begun).T
    assert len(totals) > 1
    expected = calibrated.volumes.sum() + retained * calibrated.stroke_volume
    np.testing.assert_allclose(totals, expected, rtol=1e-12)
    np.testing.assert_allclose(filled, given, rtol=1e-2)  # the rough beats
    assert filled[-1] == pytest.approx(given[-1], rel=1e-7)


@pytest.mark.slow
def test_beat_that_no_way_leads_to_from_the_last_frame_begins_at_rest(weak, monkeypatch):
    config, advance, refused = weak[0], LoadStepper.advance, []
    usual = weak[1]["mechanics"]["volume"]

    def advance_from_rest(stepper, load, unknown, *others):
        fills_again = unknown == "cavity_pressure" and stepper.circulation is None and stepper.load.time > 0
        if fills_again and not refused:
            refused.append(stepper.state)
            raise Diverged("no way leads on")
        if fills_again and len(refused) == 1:
            refused.append(stepper.state)
        return advance(stepper, load, unknown, *others)

    monkeypatch.setattr(LoadStepper, "advance", advance_from_rest)
    found = beat(config)["mechanics"]["volume"]
    last, rested = refused
    assert np.abs(last.solution - rested.solution).max() > 0
    np.testing.assert_allclose(found, usual, rtol=0, atol=1e-3 * np.ptp(usual))


def test_heart_that_is_not_steady_in_time_is_refused():
    with pytest.raises(Diverged, match=r"not steady after 1 beats .*raise loop.circulation.beats_max"):
        beat(heart(frames=6, resistance=1.5, beats_max=1))


@pytest.mark.parametrize("contractility", [1.0, 0.6])
def test_notebook_and_workflow_judge_a_heart_alike(healthy, monkeypatch, contractility):
    """By the bounds of what is found in it, here one that no weak heart meets."""
    monkeypatch.setattr(simulation, "simulate", lambda config: dict(healthy))
    config = heart(40, contractility=contractility)
    bounds = BOUNDS_OF["weak"] | {"circumferential_strain_max": -0.19}
    monkeypatch.setitem(BOUNDS_OF, "weak", bounds)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        simulation.beat(config, progress=False)
    reason = violation(measured_heart(healthy, config)[1], bounds_of(config))
    assert bool(reason) == (contractility < 1)
    assert [str(each.message) for each in told] == [f"implausible heart: {reason}"] * bool(reason)

"""Measures of motions made by formula, and the bounds on hearts."""

import numpy as np
import pytest

from echotruth.config import Config, Fibres, Geometry, Loop, Physiology
from echotruth.mechanics.beat import beat
from echotruth.mechanics.physiology import BOUNDS, measures, violated_bound
from echotruth.mechanics.twist import APICAL_SLICE, BASAL_SLICE, slice_rotation, twist

COARSE = Geometry(circumferential_elements=12, longitudinal_elements=6, transmural_elements=1)
WELL = {
    "twist": np.radians([0.0, 10.0, -15.0]),
    "longitudinal_strain": np.array(-0.1),
    "ejection_fraction": np.array(0.64),
    "volume_ratio_min": np.array(0.32),
    "loop_error": np.array(1e-8),
    "tension_min": np.array(0.0),
    "tension_es": np.array(43e3),
}


def turned(mesh, degrees):
    """Nodes turned about the long axis, by an angle (deg, counter-clockwise seen from the base) that is their own."""
    angle = np.radians(degrees)
    x, y, z = mesh.nodes.T
    return np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z], axis=-1)


def relative_height(mesh):
    """Distance from the base, over that of the endocardial apex, of every node."""
    return mesh.nodes[:, 2] / mesh.nodes[mesh.endo, 2].min()


def test_twist_is_what_was_imposed_and_positive_as_in_health(coarse_mesh):
    steps = [(0, 0), (-10, 3), (-25, 5), (4, -6)]
    frames = np.stack([turned(coarse_mesh, np.where(relative_height(coarse_mesh) > 0.5, *step)) for step in steps])
    found = twist(coarse_mesh.nodes, coarse_mesh.endo, frames)
    np.testing.assert_allclose(np.degrees(found), [base - apex for apex, base in steps], atol=1e-9)


def test_even_twist_counts_between_the_slices(coarse_mesh):
    frames = np.stack([turned(coarse_mesh, -rate * relative_height(coarse_mesh)) for rate in (0, 20)])
    found = np.degrees(twist(coarse_mesh.nodes, coarse_mesh.endo, frames))
    assert found[1] == pytest.approx(20 * (APICAL_SLICE - BASAL_SLICE), rel=0.1)


def test_twist_beyond_half_a_turn_goes_on(coarse_mesh):
    rates = np.linspace(0, 260, 6)
    frames = np.stack([turned(coarse_mesh, np.where(relative_height(coarse_mesh) > 0.5, -rate, 0)) for rate in rates])
    np.testing.assert_allclose(np.degrees(twist(coarse_mesh.nodes, coarse_mesh.endo, frames)), rates, atol=1e-9)


def test_shift_and_squeeze_are_no_rotation():
    points = np.random.default_rng(0).normal(size=(200, 2))
    squeezed = points @ np.diag([0.8, 0.8]) + [3.0, -1.0]
    np.testing.assert_allclose(slice_rotation(np.stack([points, squeezed])), 0, atol=1e-12)


def test_measures_are_those_of_the_arrays(coarse_mesh):
    still = np.zeros((4, *coarse_mesh.nodes.shape))
    strain = np.zeros((4, 6))
    strain[2, 1:3] = -0.17, -0.09
    mechanics = {
        "displacement": still,
        "pressure": np.array([500.0, 9e3, 13e3, 600.0]),
        "volume": np.array([50e-9, 45e-9, 20e-9, 30e-9]),
        "pressure_target": np.full(4, np.nan),
        "volume_target": np.array([50e-9, 45e-9, 20e-9, 30.3e-9]),
        "active_tension": np.array([0.0, 30e3, 40e3, -200.0]),
        "es_frame": np.array(2),
    }
    kinematics = {"strain_mean": strain, "volume_ratio_min": np.array([1, 0.9, 0.4, 0.8])}
    geometry = {"node_position": coarse_mesh.nodes, "endo": coarse_mesh.endo}
    found = measures(geometry, mechanics, kinematics)
    numbers = {name: float(value) for name, value in found.items() if np.ndim(value) == 0}
    assert numbers == pytest.approx(
        {
            "longitudinal_strain": -0.09,
            "circumferential_strain": -0.17,
            "ejection_fraction": 0.6,
            "volume_ratio_min": 0.4,
            "loop_error": 0.3 / 30.3,
            "tension_min": -200,
            "tension_es": 40e3,
        }
    )
    np.testing.assert_array_equal(found["twist"], np.zeros(4))


def test_a_heart_within_all_bounds_violates_none():
    assert violated_bound(WELL, Physiology()) == ""


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (
            {"longitudinal_strain": 0.036},
            "longitudinal strain at end-systole is 0.036 and must be at most 0 (physiology.lon",
        ),
        ({"twist": np.radians([0, 12, -61])}, "twist (deg) is 61 and must be at most 40 (physiology.twist_max_deg)"),
        ({"volume_ratio_min": -0.1}, "det F of all points and frames is -0.1 and must be at least 0.2"),
        ({"volume_ratio_min": np.nan}, "det F of all points and frames is nan"),
        ({"loop_error": 0.02}, "error of pressure or volume is 0.02 and must be at most 0.005"),
        ({"tension_min": -3e3}, "smallest active tension (kPa) is -3 and must be at least -1"),
        ({"tension_es": 12e3}, "end-systole (kPa) is 12 and must be at least 20 (physiology.tension_es_min_kPa)"),
        ({"tension_es": 120e3}, "is 120 and must be at most 90 (physiology.tension_es_max_kPa)"),
        ({"ejection_fraction": 0.05}, "the ejection fraction is 0.05 and must be at least 0.2"),
        ({"ejection_fraction": 0.95}, "must be at most 0.9"),
    ],
)
def test_a_violated_bound_is_reported_in_one_sentence(change, part):
    reason = violated_bound(WELL | change, Physiology())
    assert part in reason
    assert reason.endswith(".") and "\n" not in reason


def test_a_bound_that_is_null_is_not_used():
    everything = Physiology(**{bound.key: None for bound in BOUNDS})
    assert violated_bound({name: np.nan for name in WELL}, everything) == ""


def test_every_bound_of_the_section_is_checked():
    assert {bound.key for bound in BOUNDS} == set(Physiology.model_fields) - {"exclude_implausible"}


@pytest.mark.parametrize(
    ("fibres", "said"),
    [(Fibres(), ""), (Fibres(endo_deg=60.0, epi_deg=-30.0), "the mean longitudinal strain at end-systole is 0.0")],
)
def test_default_heart_is_plausible_and_one_whose_fibres_make_it_lengthen_is_not(fibres, said):
    case = beat(Config(geometry=COARSE, loop=Loop(frames=10), fibres=fibres))
    reason = violated_bound(measures(*(case[name] for name in ("geometry", "mechanics", "kinematics"))), Physiology())
    assert reason.startswith(said) and bool(reason) == bool(said)

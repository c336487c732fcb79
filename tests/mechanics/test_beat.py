"""A whole beat: the loop is met, energy is conserved, the strains are those computed independently."""

import numba
import numpy as np
import pytest

from echotruth.config import Config, Fibres, Geometry, Loop, Mechanics
from echotruth.heart import Heart
from echotruth.materials import LAWS
from echotruth.mechanics import fibres
from echotruth.mechanics.beat import beat
from echotruth.mechanics.derived import centroid_kinematics, fibre_angles
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.cavity import cavity_volume
from echotruth.repository.schema import COORDINATES, HEART, arrays_of

COARSE = Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1)
HELIX = Fibres(endo_deg=84.0, epi_deg=-42.0, transverse_endo_deg=0.0, transverse_epi_deg=0.0)
PAPERS = {
    "active": {"sheet_share": 0.0, "normal_share": 0.0, "shortening_velocity_max_per_s": None},
    "pericardium": {"spring_kPa_per_mm": 0.0, "dashpot_kPa_s_per_mm": 0.0},
    "hold": "base",
}
"""The paper's wall: its fibres pull along themselves alone, and nothing surrounds it."""


MECHANICS = Mechanics.model_validate(PAPERS | {"viscosity_Pa_s": 0.0})
CONFIG = Config(geometry=COARSE, fibres=HELIX, mechanics=MECHANICS)


@pytest.fixture(scope="module")
def case():
    return beat(CONFIG)


def test_arrays_and_their_dimensions_are_those_of_the_schema(case):
    assert set(case) == set(HEART) - {"physiology"}
    for group, arrays in case.items():
        schema = arrays_of(group) | ({"time": COORDINATES["time"]} if group == "mechanics" else {})
        schema.pop("right_endo", None)  # of a heart with two ventricles
        assert set(arrays) == set(schema)
        assert {name: array.ndim for name, array in arrays.items()} == {
            name: len(array.dims) for name, array in schema.items()
        }


def test_loop_is_met_at_every_frame(case):
    mechanics = case["mechanics"]
    np.testing.assert_allclose(mechanics["volume"], mechanics["volume_target"], rtol=1e-7)
    np.testing.assert_array_equal(mechanics["pressure"], mechanics["pressure_target"])
    positions = case["geometry"]["node_position"] + mechanics["displacement"][20]
    assert cavity_volume(positions, case["geometry"]["endo"]) == pytest.approx(mechanics["volume_target"][20], rel=1e-7)


def test_tension_is_never_negative_and_vanishes_at_ed(case):
    tension = case["mechanics"]["active_tension"]
    assert tension[0] == 0
    assert tension.min() > -1.0
    assert tension[-1] < 100


def test_base_keeps_its_plane_and_does_not_turn(case):
    rim = np.unique(case["geometry"]["base"])
    moved = case["mechanics"]["displacement"][:, rim]
    assert np.all(moved[..., 2] == 0)
    np.testing.assert_allclose(np.cross(moved, case["geometry"]["node_position"][rim])[..., 2], 0, atol=1e-18)


def test_wall_keeps_its_volume(case):
    kinematics = case["kinematics"]
    assert kinematics["volume_ratio_min"].min() > 0
    assert np.abs(kinematics["volume_ratio_mean"] - 1).max() < 0.02


@pytest.mark.parametrize("law", LAWS)
def test_points_of_the_wall_keep_their_volume_at_end_systole_by_every_law(law):
    config = Config(geometry=COARSE, loop=Loop(frames=8), mechanics=Mechanics(material={"law": law}))
    arrays = beat(config, frames=(0, 1, 2, 3))
    assert arrays["kinematics"]["volume_change_rms"][arrays["mechanics"]["es_frame"]] < 0.03


def test_angles_read_back_are_those_asked_for(case):
    mesh = left_ventricle(COARSE)
    centre = fibres.interpolate_in_cells(mesh, case["fibres"]["wall_depth"], fibres.CENTROID)[:, 0]
    angles = fibre_angles(Heart.of(case, CONFIG))
    np.testing.assert_allclose(np.degrees(angles["helix_angle"]), 84 - 126 * centre, atol=1e-9)
    np.testing.assert_allclose(angles["transverse_angle"], 0, atol=1e-9)


def test_strain_on_reading_is_that_which_was_stored_and_half_of_the_change_of_squared_lengths(case):
    """E f . f = (|F f|^2 - |F_ED f|^2) / (2 |F_ED f|^2) along a fibre f, from ED."""
    found = centroid_kinematics(Heart.of(case, CONFIG))
    assert found["strain"].shape == (40, len(case["geometry"]["cell_node"]), 6)
    np.testing.assert_allclose(found["strain"], case["kinematics"]["strain"], rtol=1e-6, atol=1e-7)
    length = np.linalg.norm(found["deformation_gradient"] @ case["fibres"]["fibre"][..., None], axis=-2)[..., 0]
    np.testing.assert_allclose(found["fibre_strain_unloaded"][..., 0], (length**2 - 1) / 2, atol=1e-12)
    np.testing.assert_allclose(found["fibre_strain"][..., 0], ((length / length[0]) ** 2 - 1) / 2, atol=1e-12)
    j = np.linalg.det(found["deformation_gradient"])
    for name in ("strain_unloaded", "fibre_strain_unloaded"):
        rr, cc, ll, rc, rl, cl = (2 * found[name][..., k] for k in range(6))
        determinant = (1 + rr) * ((1 + cc) * (1 + ll) - cl**2) - rc * (rc * (1 + ll) - cl * rl)
        determinant += rl * (rc * cl - (1 + cc) * rl)
        np.testing.assert_allclose(determinant, j**2, rtol=1e-9)  # det C, whatever the axes


def test_given_stiffness_scales_the_volumes():
    stiff = Config(
        geometry=COARSE, loop=Loop(frames=4), mechanics=Mechanics(material={"stiffness_kPa": 2.0}, base="fixed")
    )
    mechanics = beat(stiff)["mechanics"]
    assert mechanics["stiffness"] == 2000
    assert mechanics["volume"][0] < 49e-9
    np.testing.assert_allclose(mechanics["volume"], mechanics["volume_target"], rtol=1e-7)


def test_few_frames_converge_and_bytes_do_not_depend_on_threads():
    runs = []
    for threads in (numba.config.NUMBA_NUM_THREADS, 1):
        numba.set_num_threads(threads)
        runs.append(beat(Config(geometry=COARSE, loop=Loop(frames=10))))
    for group, arrays in runs[0].items():
        for name, values in arrays.items():
            assert values.tobytes() == runs[1][group][name].tobytes(), f"{group}/{name}"

"""Motion from files is that of the formula, or of the heart, by which the files were made."""

import re
from pathlib import Path

import numpy as np
import pytest
from affine_motion import FRAMES, TRANSLATION, amplitude, gradient

from echotruth.config import Config
from echotruth.fem.tetrahedra import EDGES
from echotruth.heart import Heart
from echotruth.mechanics.derived import centroid_kinematics
from echotruth.mechanics.motion_file.motion import motion_from_file
from echotruth.mechanics.motion_file.wall import first_of_largest
from echotruth.mechanics.physiology import measures
from echotruth.mechanics.solver.cavity import cavity_volume

FORMATS = [("vtu", 1), ("npy", 2)]
SLOW_FORMATS = [("vtk", 1), ("pvtu", 1), ("pvd", 2), ("npz", 1)]
"""Formats and orders of the tetrahedra."""


def check_affine(arrays, frames, rtol=1e-6):
    """Displacement, strain and volume of all frames, against the formula."""
    nodes, mechanics = arrays["geometry"]["node_position"], arrays["mechanics"]
    deformation = centroid_kinematics(Heart.of(arrays, Config()))["deformation_gradient"]
    for frame, a in enumerate(amplitude(np.arange(frames) / frames)):
        exact = nodes @ (gradient(a) - np.eye(3)).T + 1e-3 * a * TRANSLATION
        np.testing.assert_allclose(mechanics["displacement"][frame], exact, rtol=0, atol=rtol * 1e-3)
        found = deformation[frame]
        np.testing.assert_allclose(found, np.broadcast_to(gradient(a), found.shape), rtol=0, atol=10 * rtol)
        volume = np.linalg.det(gradient(a)) * cavity_volume(nodes, arrays["geometry"]["endo"])
        assert mechanics["volume"][frame] == pytest.approx(volume, rel=10 * rtol)


@pytest.mark.parametrize(
    ("format_", "order"), [*FORMATS, *(pytest.param(*each, marks=pytest.mark.slow) for each in SLOW_FORMATS)]
)
def test_files_of_an_affine_motion_give_its_displacement_strain_and_volume(
    affine_heart, write_series, configured, format_, order
):
    _, cells = affine_heart.of_order[order]
    positions = affine_heart.positions(order, np.arange(FRAMES) / FRAMES)
    arrays = motion_from_file(configured(write_series(format_, positions, cells)))
    check_affine(arrays, FRAMES)
    assert arrays["geometry"]["cell_node"].shape == (len(cells), 10)
    assert int(arrays["mechanics"]["es_frame"]) == FRAMES // 2
    np.testing.assert_allclose(arrays["mechanics"]["time"], np.arange(FRAMES) / FRAMES * 0.12, rtol=1e-12)


def test_recipe_makes_the_same_motion_of_xdmf(affine_heart, write_series, configured, monkeypatch):
    """By its Python in docs/motion.md."""
    _, cells = affine_heart.of_order[1]
    write_series("xdmf", affine_heart.positions(1, np.arange(FRAMES) / FRAMES), cells)
    page = (Path(__file__).parents[3] / "docs/motion.md").read_text()
    (recipe,) = (code for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "xdmf" in code)
    exec(recipe, {})
    arrays = motion_from_file(configured({"path": "motion.npz", "displacement": "u"}, file="heart.vtu"))
    check_affine(arrays, FRAMES)


def test_wall_of_linear_tetrahedra_stays_straight_between_its_vertices(affine_heart, write_series, configured):
    _, cells = affine_heart.of_order[1]
    positions = affine_heart.positions(1, np.arange(FRAMES) / FRAMES)
    positions[1:] += np.random.default_rng(1).normal(0, 0.01, positions[1:].shape)
    arrays = motion_from_file(configured(write_series("npy", positions, cells)))
    node, cell = arrays["geometry"]["node_position"], arrays["geometry"]["cell_node"]
    moved = node + arrays["mechanics"]["displacement"][3]
    ends = moved[cell[:, EDGES]]
    np.testing.assert_allclose(moved[cell[:, 4:]], ends.mean(axis=2), rtol=0, atol=1e-15)


@pytest.mark.slow
def test_frames_of_the_files_are_not_interpolated_and_others_are_near_the_formula(
    affine_heart, write_series, configured
):
    _, cells = affine_heart.of_order[1]
    positions = affine_heart.positions(1, np.arange(FRAMES) / FRAMES)
    section = write_series("vtu", positions, cells)
    as_recorded = motion_from_file(configured(section))["mechanics"]["displacement"]
    twice = motion_from_file(configured(section, frames=2 * FRAMES))
    np.testing.assert_array_equal(twice["mechanics"]["displacement"][::2], as_recorded)
    # The error of a periodic cubic spline of sin^2 at 12 points, halfway: (pi / 12)^4 / 16 of the amplitude's 2/2.
    check_affine(twice, 2 * FRAMES, rtol=1e-3)


@pytest.mark.slow
def test_cycle_begins_at_the_largest_cavity_or_the_named_frame_and_may_repeat_its_first(
    affine_heart, write_series, configured
):
    _, cells = affine_heart.of_order[1]
    phases = (np.arange(FRAMES + 1) - 4) / FRAMES
    repeated = write_series("npy", affine_heart.positions(1, phases), cells)
    arrays = motion_from_file(configured(repeated))
    np.testing.assert_allclose(arrays["mechanics"]["displacement"][0], 0, atol=1e-18)
    check_affine(arrays, FRAMES)
    arrays = motion_from_file(configured(repeated | {"ed_frame": 5}))
    volume = arrays["mechanics"]["volume"]
    assert volume[0] < volume[-1] and volume.argmax() == FRAMES - 1


def test_frames_select_one_cycle_of_several(affine_heart, write_series, configured):
    _, cells = affine_heart.of_order[1]
    phases = np.arange(-3, 2 * FRAMES) / FRAMES
    positions = affine_heart.positions(1, phases)
    positions[:3] *= 1.01  # a cycle before the heart is periodic
    section = write_series("npy", positions, cells) | {"frames": [3 + FRAMES, 2 + 2 * FRAMES]}
    check_affine(motion_from_file(configured(section)), FRAMES)


@pytest.mark.slow
def test_uneven_times_tell_when_the_frames_were(affine_heart, write_series, configured):
    """Frames at warped phases, with their times, against the formula at equal steps; without them it is not met."""
    _, cells = affine_heart.of_order[1]
    even = np.arange(41) / 40
    warped = even + 0.1 * np.sin(2 * np.pi * even) / (2 * np.pi)
    section = write_series("npy", affine_heart.positions(1, warped), cells)
    check_affine(motion_from_file(configured(section | {"times": (800 * warped).tolist()})), FRAMES, rtol=1e-4)
    with pytest.raises(AssertionError):
        check_affine(motion_from_file(configured(section)), FRAMES, rtol=1e-4)


@pytest.mark.slow
def test_times_of_a_pvd_file_are_read(affine_heart, write_series, configured):
    _, cells = affine_heart.of_order[1]
    even = np.arange(41) / 40
    warped = even + 0.1 * np.sin(2 * np.pi * even) / (2 * np.pi)
    section = write_series("pvd", affine_heart.positions(1, warped), cells, times=0.8 * warped)
    check_affine(motion_from_file(configured(section)), FRAMES, rtol=1e-4)


@pytest.mark.slow
def test_unit_is_any_length(affine_heart, write_series, configured):
    _, cells = affine_heart.of_order[1]
    positions = affine_heart.positions(1, np.arange(FRAMES) / FRAMES)
    section = write_series("npy", 10 * positions, cells)
    point = (10 * positions[0, :, :].mean(axis=0)).tolist()
    arrays = motion_from_file(configured(section, unit="um", scale=100.0, septum_point=point))
    endo = arrays["geometry"]["endo"]
    expected = motion_from_file(configured(write_series("npy", positions, cells)))["mechanics"]["volume"]
    np.testing.assert_allclose(arrays["mechanics"]["volume"], expected, rtol=1e-9)
    assert cavity_volume(arrays["geometry"]["node_position"], endo) == pytest.approx(expected[0], rel=1e-6)


def test_heart_without_pressures_has_volumes_phases_and_measures(affine_heart, write_series, configured):
    _, cells = affine_heart.of_order[2]
    positions = affine_heart.positions(2, np.arange(FRAMES) / FRAMES)
    arrays = motion_from_file(configured(write_series("npy", positions, cells)))
    mechanics = arrays["mechanics"]
    for name in ("pressure", "pressure_target", "volume_target", "active_tension", "residual", "stiffness"):
        assert np.isnan(mechanics[name]).all()
    assert (np.diff(mechanics["phase"][: FRAMES // 2 + 1].astype(int)) >= 0).all() and mechanics["phase"][-1] == 0
    depth = arrays["fibres"]["wall_depth"]
    found = measures(arrays["geometry"], mechanics, arrays["kinematics"], depth)
    assert found["ejection_fraction"] == pytest.approx(1 - np.linalg.det(gradient(1.0)), rel=1e-6)


def test_end_diastole_is_the_first_frame_of_an_isovolumic_contraction():
    assert first_of_largest(np.array([3.0, 5.0, 5.0 + 1e-6, 5.0, 4.0])) == 1
    assert first_of_largest(np.array([5.0, 5.0 + 1e-6, 4.0, 3.0, 5.0])) == 4
    assert first_of_largest(np.array([4.99, 5.0, 4.0, 3.0])) == 1


@pytest.mark.slow
def test_beat_that_is_written_and_read_again_moves_as_before(write_series):
    """Displacement, gradient, volume and the truth in an image; the base is plane, and x is the axis of the files."""
    from echotruth.imaging.bmode import pixel_centres
    from echotruth.imaging.labels import unpack
    from echotruth.imaging.truth import pixel_truth
    from echotruth.imaging.view import Plane, imaging_plane
    from echotruth.mechanics.beat import beat

    mesh = {"circumferential_elements": 6, "longitudinal_elements": 6, "transmural_elements": 1}
    config = Config(geometry=mesh, loop={"frames": 10})
    solved = beat(config)
    geometry, displacement = solved["geometry"], solved["mechanics"]["displacement"]
    positions = 1e3 * (geometry["node_position"] + displacement)
    section = write_series("vtu", positions, geometry["cell_node"])
    loop = {"frames": 10, "heart_rate_per_min": 500.0}
    again = Config(motion={"kind": "file", "file": section}, loop=loop)
    read = motion_from_file(again)
    # Merging points numbers them anew.
    cell, cell_read = geometry["cell_node"], read["geometry"]["cell_node"]
    since_ed = (displacement - displacement[0])[:, cell]
    np.testing.assert_allclose(read["mechanics"]["displacement"][:, cell_read], since_ed, rtol=0, atol=1e-10)
    np.testing.assert_allclose(read["mechanics"]["volume"], solved["mechanics"]["volume"], rtol=1e-6)
    hearts = Heart.of(solved, config), Heart.of(read, again)
    f, f_read = (centroid_kinematics(heart)["deformation_gradient"] for heart in hearts)
    np.testing.assert_allclose(f_read, f @ np.linalg.inv(f[0]), rtol=0, atol=2e-5)
    strains = [arrays["kinematics"]["strain_mean"] for arrays in (read, solved)]
    np.testing.assert_allclose(*strains, rtol=0, atol=5e-3)  # R is that of the wall at end-diastole
    # The origin is the centroid of the rim at end-diastole, not unloaded.
    moved = hearts[1].positions(0)[cell_read[:, 0]] - hearts[0].positions(0)[cell[:, 0]]
    shift = moved.mean(axis=0)
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape), rtol=0, atol=1e-10)
    assert np.abs(shift).max() < 5e-6
    plane = imaging_plane(config.views["mid"], config.rf, hearts[0].endo_at_ed)
    planes = plane, Plane(plane.origin + shift, plane.axes)
    pixels = pixel_centres(config.bmode, 128)
    truths = [pixel_truth(heart, at, *pixels) for heart, at in zip(hearts, planes, strict=True)]
    walls = [unpack(truth["labels"])["mask"] for truth in truths]
    both = walls[0] & walls[1]
    assert both.sum() > 0.999 * walls[0].sum()
    displacements = [truth["displacement"][both] for truth in truths]
    np.testing.assert_allclose(*displacements, rtol=0, atol=1e-9)

"""Prescribed motions against their formulas: in the elements, in the strains, and in the image."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scenes import scene
from skimage.registration import phase_cross_correlation

from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.fem.tetrahedra import Mesh, shape
from echotruth.fem.volume import cell_volumes
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.bmode import bmode_clip, time_gain_compensation
from echotruth.imaging.medium.wall import Wall
from echotruth.imaging.view import imaging_plane
from echotruth.mechanics.derived import centroid_kinematics
from echotruth.mechanics.fibres import CENTROID
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.physiology import measures
from echotruth.mechanics.prescribed import MotionError, displacement_at, motion_amplitude, prescribed_motion
from echotruth.units import mm

INNER, OUTER, LENGTH = 1.45e-3, 2.45e-3, 6.8e-3
"""Of the default tube, m."""

PHANTOMS = Path(__file__).parents[2] / "config/phantoms.yaml"


def config(kind, elements=(12, 4, 1), frames=2, **section):
    around, along, through = elements
    counts = {"circumferential_elements": around, "longitudinal_elements": along, "transmural_elements": through}
    motion = {"kind": kind, "time_course": "ramp", kind: section}
    geometry = {"shape": "tube", "wall_mm": 1.0, **counts}
    return Config(geometry=geometry, loop={"file": "mouse", "frames": frames}, motion=motion)


def heart(config, arrays=None):
    arrays = arrays or prescribed_motion(config)
    geometry, mechanics = arrays["geometry"], arrays["mechanics"]
    return Heart(
        geometry["node_position"],
        geometry["cell_node"],
        mechanics["displacement"],
        arrays["fibres"]["wall_depth"],
        geometry["endo"],
        config.fibres.layers,
        int(mechanics["es_frame"]),
    )


def in_elements(mesh, displacement, random):
    """Random places in every element, (n_cells, 40, 3), m, and how the element moves them."""
    values = shape(random.dirichlet(np.ones(4), 40)[:, :3])
    return (np.einsum("qa,cai->cqi", values, each[mesh.cells]) for each in (mesh.nodes, displacement))


def tube_strain(section, radius):
    """RR, CC, LL, RC, RL, CL of the default tube by hand, from C = F^T F in polar coordinates; radius at ED, m."""
    stretch, inner = 1 - section.shortening, INNER * (1 - section.contraction)
    r = np.sqrt(inner**2 + (radius**2 - INNER**2) / stretch)
    growth, torsion = radius / (stretch * r), np.radians(section.torsion_deg) / LENGTH
    shear = r * np.radians(section.endo_rotation_deg) / (OUTER - INNER)
    hoop, along = r / radius, r * torsion
    c = [growth**2 + shear**2, hoop**2, stretch**2 + along**2, shear * hoop, shear * along, hoop * along]
    return (np.stack(c, axis=-1) - [1, 1, 1, 0, 0, 0]) / 2


def test_triangle_and_ramp_go_in_equal_steps_the_cosine_is_smooth_and_all_are_whole_at_mid_cycle():
    np.testing.assert_allclose(motion_amplitude("triangle", 20)[:11], np.arange(11) / 10)
    np.testing.assert_allclose(motion_amplitude("ramp", 11), np.arange(11) / 10)
    np.testing.assert_allclose(
        motion_amplitude("cosine", 40), (1 - np.cos(2 * np.pi * np.arange(40) / 40)) / 2, atol=1e-15
    )
    for name in ("cosine", "triangle"):
        assert motion_amplitude(name, 5)[[0, 2]] == pytest.approx([0, 1], abs=1e-15)  # whole at mid-cycle of odd cycles


@pytest.mark.parametrize("kind", ["rigid", "affine", "tube"])
def test_nothing_has_moved_at_end_diastole_and_most_at_end_systole(kind):
    mechanics = prescribed_motion(config(kind, frames=3))["mechanics"]
    assert not mechanics["displacement"][0].any()
    assert np.linalg.norm(mechanics["displacement"], axis=-1).max(axis=1).argmax() == mechanics["es_frame"] == 2


def test_tube_has_the_volume_of_a_tube_and_keeps_it():
    setting = config("tube", (24, 4, 2))
    mesh, after = left_ventricle(setting.geometry), heart(setting).positions(1)
    volume = np.pi * (OUTER**2 - INNER**2) * LENGTH
    assert cell_volumes(mesh.nodes, mesh.cells).sum() == pytest.approx(volume, rel=1e-4)
    moved = Mesh(after, mesh.cells, mesh.endo, mesh.epi, mesh.base)
    assert cell_volumes(moved.nodes, moved.cells).sum() == pytest.approx(volume, rel=1e-4)
    radius = np.hypot(*after[np.unique(mesh.endo), :2].T)
    np.testing.assert_allclose(radius, 0.65 * INNER, rtol=1e-12)
    assert np.ptp(after[:, 2]) == pytest.approx(0.9 * LENGTH)


def test_a_shift_has_its_components_in_the_short_axis_image_and_no_strain():
    setting = config("rigid", lateral_um=30.0, axial_um=-20.0, elevation_um=10.0)
    arrays = prescribed_motion(setting)
    moving = heart(setting, arrays)
    view = imaging_plane(setting.views["mid"], setting.rf, moving.positions(0)[moving.endo.ravel()])
    shift = view.to_image(moving.positions(1)) - view.to_image(moving.positions(0))
    np.testing.assert_allclose(shift, np.tile([30e-6, -20e-6, 10e-6], (len(shift), 1)), atol=1e-17)
    assert np.abs(arrays["kinematics"]["strain"]).max() < 1e-7


def test_a_turn_is_counter_clockwise_in_the_image_and_no_strain():
    setting = config("rigid", lateral_um=0.0, axial_um=0.0, rotation_deg=30.0)
    arrays = prescribed_motion(setting)
    moving = heart(setting, arrays)
    view = imaging_plane(setting.views["mid"], setting.rf, moving.positions(0)[moving.endo.ravel()])
    x, depth, _ = (view.to_image(moving.positions(0)) - [0, 6.5e-3, 0]).T
    expected = x * np.cos(np.radians(30)) + depth * np.sin(np.radians(30))  # depth points down in the image
    np.testing.assert_allclose(view.to_image(moving.positions(1))[:, 0], expected, atol=1e-17)
    assert np.abs(arrays["kinematics"]["strain"]).max() < 1e-7


def test_an_affine_motion_has_its_gradient_in_the_image_in_every_frame_and_element():
    gradient = np.array([[0.8, 0.1, 0.05], [-0.2, 1.2, 0.1], [0.03, -0.04, 0.9]])
    setting = config("affine", frames=3, gradient=gradient.tolist(), position=0.5)
    arrays = prescribed_motion(setting)
    moving = heart(setting, arrays)
    turn = imaging_plane(setting.views["mid"], setting.rf, moving.positions(0)[moving.endo.ravel()]).axes
    for frame, amplitude in enumerate((0, 0.5, 1)):
        expected = turn.T @ (np.eye(3) + amplitude * (gradient - np.eye(3))) @ turn
        found = centroid_kinematics(Heart.of(arrays, setting), [frame])["deformation_gradient"][0]
        np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=1e-6)
    mesh = left_ventricle(setting.geometry)
    np.testing.assert_allclose(displacement_at(setting, mesh, np.array([0, 0, -LENGTH / 2]), 1.0), 0, atol=1e-18)


def test_the_cylinder_has_the_gradient_of_its_formula():
    """Central differences of the formula give the strains in closed form, and no change of volume."""
    setting, step = config("tube", torsion_deg=40.0, endo_rotation_deg=20.0), 1e-7
    mesh, random = left_ventricle(setting.geometry), np.random.default_rng(1)
    radius, turn = random.uniform(INNER, OUTER, 50), random.uniform(0, 2 * np.pi, 50)
    place = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), random.uniform(-LENGTH, 0, 50)])
    by = partial(displacement_at, setting, mesh, amplitude=1.0)
    slopes = [(by(place + step * axis) - by(place - step * axis)) / (2 * step) for axis in np.eye(3)]
    gradient = np.eye(3) + np.stack(slopes, axis=-1)
    np.testing.assert_allclose(np.linalg.det(gradient), 1, atol=1e-7)
    cos, sin, none = np.cos(turn), np.sin(turn), np.zeros(50)
    axes = np.stack([np.stack([cos, sin, none]), np.stack([-sin, cos, none]), np.stack([none, none, none + 1])])
    along = np.einsum("pij,kjp->pik", gradient, axes)
    whole = (np.einsum("pki,pkj->pij", along, along) - np.eye(3)) / 2
    found = np.stack([whole[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))], axis=-1)
    np.testing.assert_allclose(found, tube_strain(setting.motion.tube, radius), atol=1e-7)


def test_strain_of_the_cylinder_converges_to_its_closed_form():
    errors = []
    for elements in ((12, 4, 2), (24, 8, 4)):
        setting = config("tube", elements)
        mesh = left_ventricle(setting.geometry)
        radius = np.hypot(*(shape(CENTROID) @ mesh.nodes[mesh.cells])[:, 0, :2].T)
        exact = tube_strain(setting.motion.tube, radius)
        found = prescribed_motion(setting)["kinematics"]["strain"][1]
        errors.append(np.sqrt(np.mean((found - exact) ** 2, axis=0)))
    assert errors[1].max() < 0.005
    assert (errors[1] < errors[0] / 2.5).all(), "of second order, 4, where the mesh is fine"


@pytest.mark.parametrize("setting, off", [(config("tube", (24, 12, 3)), 8e-4), (load(PHANTOMS), 5e-4)])
def test_elements_carry_the_tissue_of_the_cylinder_as_the_formula_says(setting, off):
    """Elements of the default mesh, and of config/phantoms.yaml: what carries the scatterers is the truth."""
    mesh = left_ventricle(setting.geometry)
    displacement = displacement_at(setting, mesh, mesh.nodes, 1.0)
    place, found = in_elements(mesh, displacement, np.random.default_rng(1))
    exact = displacement_at(setting, mesh, place, 1.0)
    assert np.sqrt(np.sum((found - exact) ** 2) / np.sum(exact**2)) < off


@pytest.mark.parametrize("kind", ["rigid", "affine"])
def test_elements_carry_rigid_and_affine_motion_to_the_last_bits(kind):
    setting = config(kind, elements=(12, 4, 1))
    mesh = left_ventricle(setting.geometry)
    place, found = in_elements(mesh, displacement_at(setting, mesh, mesh.nodes, 1.0), np.random.default_rng(1))
    np.testing.assert_allclose(found, displacement_at(setting, mesh, place, 1.0), rtol=0, atol=1e-17)


def test_torsion_twists_as_a_healthy_heart_does():
    """The nodes of the slices at 0.2 and 0.8 lie about 5/24 and 19/24."""
    arrays = prescribed_motion(config("tube", (24, 12, 1), torsion_deg=20.0, endo_rotation_deg=0.0))
    found = measures(arrays["geometry"], arrays["mechanics"], arrays["kinematics"])
    assert np.degrees(found["twist"][1]) == pytest.approx(20 * 14 / 24)


def test_a_motion_into_the_array_is_refused_in_one_sentence():
    with pytest.raises(MotionError) as caught:
        prescribed_motion(config("rigid", axial_um=-4000.0))
    assert "motion.rigid moves the wall by up to 4 mm, and it is 3.1 mm from the array" in str(caught.value)


def test_the_image_moves_as_asked():
    """B-mode of a shift by 5 and -4 pixels, against the registration of scikit-image."""
    setting = config("rigid", lateral_um=117.1875, axial_um=-93.75)
    imaging = {"phantom": {"density_per_mm3": 300.0}, "probe": {"elements": 32}, "rf": {"lines": 128}}
    setting = Config(**{**setting.model_dump(include={"geometry", "loop", "motion"}), **imaging})
    moving = heart(setting)
    scatterers = Wall.seed(scene(setting, moving))
    scanner = Scanner(setting.probe, setting.rf, setting.bmode.field_of_view_mm * mm)
    lines = np.stack([scanner.lines(scatterers.positions(frame), scatterers.amplitude) for frame in (0, 1)])
    gain = time_gain_compensation(setting.probe, setting.bmode, scanner.range)
    before, after = bmode_clip(lines, scanner.scan, scanner.range, setting.bmode, gain)[512].astype(float)
    shift = phase_cross_correlation(after, before, upsample_factor=100, normalization=None)[0]
    np.testing.assert_allclose(shift, [-4, 5], atol=0.15)

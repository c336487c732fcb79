"""Truth: pixels know the motion, strain and place of their tissue, as exactly as the scatterers do."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.config import Config, Phantom
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import interpolate
from echotruth.imaging.labels import unpack
from echotruth.imaging.medium.wall import seed_volume
from echotruth.imaging.truth import PixelTruth, cavity_centroid, displacement, material_truth, pixel_truth
from echotruth.imaging.view import imaging_plane

CONFIG = Config()
AXIS = (np.arange(96) + 0.5) / 96 * 12e-3


@pytest.fixture(scope="module")
def mid(twisting_heart):
    return imaging_plane(CONFIG.views["mid"], CONFIG.rf, twisting_heart.positions(0)[twisting_heart.endo.ravel()])


@pytest.fixture(scope="module")
def moved(twisting_heart, mid):
    return _frame(pixel_truth(twisting_heart, mid, AXIS, AXIS - 6e-3), 1)


def _frame(clip, number):
    return {name: each[number] for name, each in (clip | unpack(clip["labels"])).items()}


def _positions(mask, mid):
    axial, lateral = AXIS[np.nonzero(mask)[0]], AXIS[np.nonzero(mask)[1]] - 6e-3
    return mid.to_heart(np.column_stack([lateral, axial, np.zeros(len(axial))]))


def test_displacement_of_an_affine_motion_is_the_formula(moved, mid, affine):
    matrix, shift = affine
    now = _positions(moved["mask"], mid)
    before = (now - shift) @ np.linalg.inv(matrix).T
    expected = (now - before) @ mid.axes.T
    assert np.abs(moved["displacement"][moved["mask"]] - expected).max() < 1e-10  # stored in single precision


def test_strain_of_an_affine_motion_is_the_formula(moved, affine):
    # Squeezed by 0.85 across and 0.93 along the axis: E_CC is the same at every point; the trace is invariant.
    matrix, _ = affine
    green = (matrix.T @ matrix - np.eye(3)) / 2
    strain = moved["strain"][moved["mask"]]
    assert np.allclose(strain[:, 1], green[0, 0], atol=1e-6)
    assert np.allclose(strain[:, :3].sum(axis=1), np.trace(green), atol=1e-6)


def test_a_scatterer_and_the_pixel_at_its_place_agree_to_round_off(twisting_heart):
    heart = twisting_heart
    scattered = seed_volume(Phantom(density_per_mm3=200.0), heart.nodes, heart.cells, np.random.default_rng(0))
    at_pixel = locate(heart.positions(1), heart.cells, interpolate(heart.positions(1), heart.cells, scattered))
    difference = displacement(heart, 1, scattered) - displacement(heart, 1, at_pixel)
    assert np.abs(difference).max() < 1e-16


def test_labels_are_of_the_wall_and_nothing_is_known_outside(moved):
    inside, outside = moved["mask"], ~moved["mask"]
    assert inside.any() and outside.any()
    assert set(np.unique(moved["layer"][inside])) == set(range(1, 7))
    assert set(np.unique(moved["segment"][inside])) == set(range(7, 13))
    assert np.isnan(moved["displacement"][outside]).all() and np.isnan(moved["wall_depth"][outside]).all()
    assert not moved["layer"][outside].any() and not moved["segment"][outside].any()
    assert np.array_equal(moved["layer"][inside], np.clip(np.floor(6 * moved["wall_depth"][inside]) + 1, 1, 6))


def test_the_wall_in_the_image_has_the_area_of_the_wall_in_the_plane(twisting_heart, mid):
    # The unloaded wall's cut is an annulus between two ellipses of revolution.
    fine = (np.arange(512) + 0.5) / 512 * 12e-3
    still = _frame(pixel_truth(twisting_heart, mid, fine, fine - 6e-3), 0)
    height = mid.origin[2] + 1.40e-3  # above the equator
    radii = [r * np.sqrt(1 - (height / length) ** 2) for r, length in ((1.45e-3, 5.40e-3), (2.54e-3, 5.64e-3))]
    expected = np.pi * (radii[1] ** 2 - radii[0] ** 2)
    assert still["mask"].sum() * (12e-3 / 512) ** 2 == pytest.approx(expected, rel=0.01)


def test_tracked_points_are_followed_from_where_they_were_at_end_diastole(twisting_heart, mid, affine):
    matrix, shift = affine
    points = np.stack(np.meshgrid(AXIS[::8] - 6e-3, AXIS[::8]), axis=-1)
    motion = material_truth(twisting_heart, mid, points, "short_axis")
    inside = motion["layer"] > 0
    start = mid.to_heart(np.column_stack([points[inside], np.zeros(inside.sum())]))
    expected = (start @ (matrix - np.eye(3)).T + shift) @ mid.axes.T
    assert np.allclose(motion["true_displacement"][1][inside], expected[:, :2], atol=1e-10)
    assert np.allclose(motion["through_plane"][1][inside], expected[:, 2], atol=1e-10)
    assert np.isnan(motion["true_displacement"][1][~inside]).all()


@pytest.fixture(scope="module")
def followed(twisting_heart, mid):
    """Motion of points in the wall by name, and their positions from the long axis, lateral, axial."""
    points = np.stack(np.meshgrid(AXIS[::4] - 6e-3, AXIS[::4]), axis=-1)
    motion = material_truth(twisting_heart, mid, points, "short_axis")
    inside = motion["layer"] > 0
    frames = {name: motion[name][1][inside] for name in ("heart_strain", "plane_strain")}
    return frames | {"axes": motion["wall_axes"][inside], "arm": points[inside] - [0, 6.5e-3]}


def test_axes_of_the_wall_in_a_short_axis_image_are_those_of_its_circle(followed):
    radial = followed["arm"] / np.linalg.norm(followed["arm"], axis=1)[:, None]
    # C runs counter-clockwise seen from the base, and the image is seen from the apex.
    tangential = np.stack([-radial[:, 1], radial[:, 0]], -1)
    expected = np.stack([radial, tangential], 1)
    cosines = np.einsum("nai,nai->na", followed["axes"], expected)
    assert cosines.min() > np.cos(np.radians(8))  # the coarse mesh has twelve sides
    assert cosines.mean() > np.cos(np.radians(3))
    np.testing.assert_allclose(
        followed["axes"] @ np.swapaxes(followed["axes"], 1, 2), np.tile(np.eye(2), (len(radial), 1, 1)), atol=1e-6
    )


def test_strain_in_the_plane_of_an_affine_motion_is_the_formula(twisting_heart, mid):
    sheared = np.array([[1.1, 0.2, 0.05], [-0.1, 0.8, 0.1], [0.02, -0.07, 0.95]])
    moved = np.stack([0 * twisting_heart.nodes, twisting_heart.nodes @ (sheared - np.eye(3)).T])
    points = np.stack(np.meshgrid(AXIS[::4] - 6e-3, AXIS[::4]), axis=-1)
    motion = material_truth(replace(twisting_heart, displacement=moved), mid, points, "short_axis")
    inside = motion["layer"] > 0
    matrix, axes = (mid.axes @ sheared @ mid.axes.T)[:2, :2], motion["wall_axes"][inside]
    green = (matrix.T @ matrix - np.eye(2)) / 2
    for k, (a, b) in enumerate(((0, 0), (1, 1), (0, 1))):
        expected = np.einsum("ni,ij,nj->n", axes[:, a], green, axes[:, b])
        np.testing.assert_allclose(motion["plane_strain"][1][inside][:, k], expected, atol=1e-6)


def test_strain_of_the_heart_at_followed_points_is_that_along_the_walls_axes_in_space(followed, affine):
    # Squeezed alike in all directions across the axis: E_CC is the same at every point.
    green = (affine[0].T @ affine[0] - np.eye(3)) / 2
    np.testing.assert_allclose(followed["heart_strain"][:, 1], green[0, 0], atol=1e-6)
    # The wall leans to the plane, so that its thickening there is not all of it.
    assert np.abs(followed["heart_strain"][:, 0] - followed["plane_strain"][:, 0]).max() > 1e-4


def test_along_the_long_axis_the_tangential_strain_is_the_longitudinal(twisting_heart, affine):
    where = imaging_plane(
        CONFIG.views["long_axis"], CONFIG.rf, twisting_heart.positions(0)[twisting_heart.endo.ravel()]
    )
    points = np.stack(np.meshgrid(AXIS[::6] - 6e-3, AXIS[::6]), axis=-1)
    motion = material_truth(twisting_heart, where, points, "long_axis")
    inside = motion["layer"] > 0
    space = motion["heart_strain"][1][inside]
    # R, C and L are orthogonal: the trace of E, less the constant E_CC, is left for the other two.
    green = (affine[0].T @ affine[0] - np.eye(3)) / 2
    np.testing.assert_allclose(space[:, 0] + space[:, 1], np.trace(green) - green[0, 0], atol=1e-6)
    upper = motion["wall_axes"][inside][:, 1, 1]
    assert upper.min() > 0, "tangential runs from apex to base, which is down"


def test_the_cavity_centre_is_on_the_axis_and_moves_with_a_shifted_heart(twisting_heart, mid):
    assert np.allclose(cavity_centroid(twisting_heart, mid), [0, 6.5e-3], atol=1e-6)
    shifted = replace(twisting_heart, nodes=twisting_heart.nodes + [0.3e-3, 0.2e-3, 0])
    assert np.allclose(cavity_centroid(shifted, mid), [-0.3e-3, 6.3e-3], atol=1e-6)


def test_the_region_of_disease_is_that_of_the_tissue_at_the_pixel(twisting_heart, mid, moved, affine):
    assert not moved["region"].any()
    corners = twisting_heart.nodes[twisting_heart.cells[:, :4]]
    septal = (corners[..., 0].mean(axis=1) > 0).astype(np.uint8)
    ill = _frame(pixel_truth(replace(twisting_heart, region=septal), mid, AXIS, AXIS - 6e-3), 1)
    matrix, shift = affine
    before = (_positions(ill["mask"], mid) - shift) @ np.linalg.inv(matrix).T
    # A cell of this coarse mesh is 1 mm wide, and the seam runs along its faces.
    clear = np.abs(before[:, 0]) > 0.6e-3
    assert np.array_equal(ill["region"][ill["mask"]][clear], (before[clear, 0] > 0).astype(np.uint8))
    assert not ill["region"][~ill["mask"]].any() and ill["region"].dtype == np.uint8


def test_asking_which_arrays_there_are_makes_none(twisting_heart, mid):
    made = []
    truth = PixelTruth(twisting_heart, mid, AXIS, AXIS - 6e-3, tissue=made.append)
    assert all(name in truth for name in ("displacement", "strain", "labels", "flow", "tissue")) and not made
    assert "stress" not in truth and "tissue" not in PixelTruth(twisting_heart, mid, AXIS[:2], AXIS[:2])

"""Tracking of volumes: exact motions of small ones, and the parts of the tracker against dense or other references."""

import numba
import numpy as np
import pytest
from scipy import ndimage, stats

from echotruth.config.building import configure, tracker_section
from echotruth.config.tracking import BsplineCnn, BsplineDic, Dis, PhaseCorrelation, name_of
from echotruth.tracking import TrackerFailed, track
from echotruth.tracking.quality import within
from echotruth.tracking.speckle import speckle_length
from echotruth.tracking.trilinear import trilinear_lattice
from echotruth.tracking.volume_region import bending_matrix, coefficients, interpolate_with_gradient, second_differences

SPACING = np.array([66e-6, 66e-6, 44e-6])
SHAPE = (48, 24, 40)
MIDDLE = (np.array(SHAPE[::-1]) - 1) / 2
WIDTHS = np.array([1.5, 1.5, 1.0])
"""Standard deviations of the speckle along lateral, elevation, depth, voxels."""
TURN = 0.2


def volume(motion):
    """Log-compressed 8-bit envelope of random scatterers after a motion of their positions, voxels."""
    random = np.random.default_rng(5)
    position = motion(random.uniform(-6, np.array(SHAPE[::-1]) + 6, (12_000, 3)))
    weights = random.normal(size=(2, len(position)))
    x, y, z = (
        np.exp(-((np.arange(size)[:, None] - place) ** 2) / 2 / width**2).astype(np.float32)
        for size, place, width in zip(SHAPE[::-1], position.T, WIDTHS, strict=True)
    )
    plane = (y[:, None] * x).reshape(-1, len(position))
    envelope = np.hypot(*((z * weight.astype(np.float32)) @ plane.T for weight in weights)).reshape(SHAPE)
    return np.clip(255 * (1 + 20 * np.log10(envelope / envelope.max()) / 50), 0, 255).round().astype(np.uint8)


def turned(position, angle):
    """Positions after a rotation about the elevation through the middle: the voxels are not cubes."""
    arm, (cosine, sine) = (position - MIDDLE) * SPACING, (np.cos(angle), np.sin(angle))
    return MIDDLE + arm @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]) / SPACING


def beat(t, frames):
    return np.sin(np.pi * t / frames) ** 2


@pytest.fixture(scope="module")
def shifts():
    return np.array([volume(lambda position, t=t: position + beat(t, 3) * STEP) for t in range(3)])


@pytest.fixture(scope="module")
def turns():
    return np.array([volume(lambda position, t=t: turned(position, beat(t, 4) * TURN)) for t in range(4)])


STEP = np.array([1.6, -1.1, 2.2])


def tube():
    z, y, x = np.indices(SHAPE)
    radius = np.hypot((x - MIDDLE[0]) * SPACING[0], (z - MIDDLE[2]) * SPACING[2])
    return (radius > 0.25e-3) & (radius < 0.85e-3) & (abs(y - MIDDLE[1]) < 9)


def places(mask):
    return np.argwhere(mask)[::37, ::-1].astype(float)


def found(frames, settings, points=None, mask=None, spacing=SPACING):
    mask = tube() if mask is None else mask
    points = places(mask) if points is None else points
    return track(frames, points, mask, spacing, np.arange(len(frames)) * 5e-3, 0, settings)


def test_shift_is_lateral_elevation_depth_in_voxels(shifts):
    moved, quality = found(shifts, BsplineDic())
    assert moved.shape == (3, len(places(tube())), 3) and (moved[0] == 0).all() and (quality[0] == 1).all()
    error = moved[1:] - beat(np.arange(1, 3), 3)[:, None, None] * STEP
    assert np.sqrt((error**2).mean((0, 1))).max() < 0.03
    assert quality.min() >= 0 and quality.max() <= 1


def test_tube_that_turns_is_found_within_two_percent(turns):
    moved, _ = found(turns, BsplineDic())
    points = places(tube())
    true = np.array([turned(points, beat(t, 4) * TURN) - points for t in range(4)]) * SPACING
    error = moved * SPACING - true
    assert np.sqrt((error**2).sum() / (true**2).sum()) < 0.02


def test_quality_says_how_near_the_points_of_noisy_volumes_are(turns):
    """Noise of other seeds in every frame; more of it is less sure."""
    random = np.random.default_rng(1)
    noise = random.normal(size=turns.shape)
    qualities = []
    for scale in (2, 40):
        noisy = np.clip(turns + scale * noise, 0, 255).astype(np.uint8)
        qualities.append(found(noisy, BsplineDic())[1][2].mean())
    assert qualities[1] < qualities[0] - 0.1


def test_volume_without_texture_or_wall_has_no_displacement(shifts):
    points = places(tube())
    for frames, mask in ((np.zeros_like(shifts), tube()), (shifts, np.zeros(SHAPE, bool))):
        moved, quality = found(frames, BsplineDic(), points, mask)
        assert np.isnan(moved[1:]).all() and np.isnan(quality[1:]).all()


def test_points_outside_the_wall_are_lost_and_the_rest_are_not(shifts):
    points = np.array([[0.0, 0.0, 0.0], [200.0, 5.0, 5.0], [np.nan, 5.0, 5.0], places(tube())[0]])
    moved, _ = found(shifts, BsplineDic(), points)
    assert np.isnan(moved[1]).all(1).tolist() == [True, True, True, False]


def test_same_bytes_on_one_thread_and_on_two(shifts):
    kept, results = numba.get_num_threads(), []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        results.append(found(shifts, BsplineDic()))
    numba.set_num_threads(kept)
    for one, two in zip(*results, strict=True):
        np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("method", [Dis, PhaseCorrelation, BsplineCnn], ids=name_of)
def test_flat_tracker_refuses_volumes_in_one_sentence(shifts, method):
    with pytest.raises(TrackerFailed, match=r"^\w+ tracks slices: volumes need bspline_dic, or a function or program$"):
        found(shifts, method())


def test_function_tracks_volumes(shifts):
    def rising(frames, points, mask, spacing, frame_time, seed):
        assert frames.ndim == 4 and mask.shape == frames.shape[1:] and spacing.shape == (3,)
        return np.multiply.outer(np.arange(len(frames)), np.ones_like(points))

    moved, quality = found(shifts, tracker_section(configure(), rising, {}))
    np.testing.assert_array_equal(moved[2], 2)
    assert np.isnan(quality).all()


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"spacing": 66e-6}, r"three|\(lateral, elevation, depth\)"),
        ({"spacing": np.array([66e-6, -66e-6, 44e-6])}, "positive lengths"),
        ({"points": np.zeros((4, 2))}, r"shape \(point, 3\)"),
        ({"mask": np.ones(SHAPE[::-1], bool)}, "shape of a frame"),
    ],
)
def test_invalid_volumes_are_refused(shifts, wrong, says):
    with pytest.raises(ValueError, match=says):
        found(shifts, BsplineDic(), **wrong)


def test_spline_and_its_gradient_are_those_of_another_program():
    random = np.random.default_rng(2)
    samples = random.normal(size=(19, 18, 17)).astype(np.float32)
    position = random.uniform(0.5, 15.5, (40, 3))

    def scipy_spline(place):
        return ndimage.map_coordinates(samples.astype(float), place[:, ::-1].T, order=3, mode="mirror")

    given = interpolate_with_gradient(coefficients(samples), position)
    np.testing.assert_allclose(given[:, 0], scipy_spline(position), atol=1e-5)
    step = 1e-4 * np.eye(3)
    slopes = np.stack([(scipy_spline(position + h) - scipy_spline(position - h)) / 2e-4 for h in step], -1)
    np.testing.assert_allclose(given[:, 1:], slopes, atol=1e-4)


@pytest.fixture(scope="module")
def lattice():
    return trilinear_lattice(places(tube()), 4.3)


def test_trilinear_field_reproduces_affine_ones_which_do_not_bend(lattice):
    random = np.random.default_rng(3)
    gradient = random.normal(size=(3, 3))
    knots = lattice.origin + lattice.knot_spacing * lattice.steps
    points = places(tube())
    np.testing.assert_allclose(lattice.evaluate(knots @ gradient, points), points @ gradient, atol=1e-9)
    assert np.isnan(lattice.evaluate(knots, np.array([MIDDLE + 300]))).all()
    matrix = bending_matrix(lattice, np.broadcast_to(np.diag([0.2, 1, 0.7]), (lattice.size, 3, 3)))
    affine, quadratic = (knots @ gradient + 1).ravel(), (knots**2).ravel()
    assert abs(affine @ matrix @ affine) < 1e-9 * (quadratic @ matrix @ quadratic)


def test_bending_energy_is_that_of_the_scaled_second_derivatives(lattice):
    """Of the field x^T Q x along one axis H is 2 Q wherever there are knots on both sides."""
    q = np.array([[0.3, 0.1, -0.2], [0.1, -0.5, 0.4], [-0.2, 0.4, 0.2]])
    field = np.einsum("na,ab,nb->n", lattice.steps, q, lattice.steps)
    h = (second_differences(lattice) @ field).reshape(-1, 6)
    inner = (h[:, :3] != 0).all(1)
    np.testing.assert_allclose(h[inner].T, np.tile(2 * q[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]][:, None], inner.sum()))
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    metric = turn @ np.diag([0.2, 1, 1]) @ turn.T
    matrix = bending_matrix(lattice, np.broadcast_to(metric, (lattice.size, 3, 3)))
    full = h[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    expected = ((metric @ full @ metric) ** 2).sum()
    vector = np.kron(field, [1.0, 0, 0])
    other = np.kron(lattice.steps[:, 0] ** 2.0, [0, 1.0, 0])
    bent = (second_differences(lattice) @ lattice.steps[:, 0] ** 2.0).reshape(-1, 6)
    bent = bent[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    ratio = expected / ((metric @ bent @ metric) ** 2).sum()
    assert (vector @ matrix @ vector) / (other @ matrix @ other) == pytest.approx(ratio)


def test_normal_matrix_is_that_of_dense_basis_functions(lattice):
    random, points = np.random.default_rng(6), places(tube())
    cells, _ = lattice.sort_points(points)
    gradient, weight = random.normal(size=points.shape), random.uniform(size=len(points))
    dense = cells.evaluate(np.eye(lattice.size))
    rows = (dense[:, :, None] * gradient[:, None, :]).reshape(len(points), -1)
    expected = rows.T @ (weight[:, None] * rows)
    np.testing.assert_allclose(cells.normal_matrix(gradient, weight, lattice.size).toarray(), expected, atol=1e-12)
    np.testing.assert_allclose(cells.adjoint(gradient, lattice.size), dense.T @ gradient, atol=1e-12)


def test_error_in_space_is_within_a_radius_as_maxwell_says():
    deviation = np.array([0.1, 0.5, 2.0])
    np.testing.assert_allclose(within(1.0, deviation**2, 3), stats.maxwell.cdf(1.0, scale=deviation), rtol=1e-12)
    assert within(1.0, np.array([np.inf]), 3) == 0


def test_speckle_of_a_volume_is_as_long_as_its_scatterers_are_wide(shifts):
    """The envelope of a Gaussian beam of deviation w has a correlation length near w, here of 66 and 44 um."""
    length = speckle_length(shifts[0], tube(), SPACING / SPACING.min())
    expected = np.sqrt(np.mean((WIDTHS * SPACING / SPACING.min()) ** 2))
    assert length == pytest.approx(expected, rel=0.35)

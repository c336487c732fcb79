"""The parts of the B-spline tracker against other libraries and closed forms."""

import cv2
import numpy as np
import pytest
from scipy import interpolate, ndimage, stats

from echotruth.imaging import spline
from echotruth.tracking import alignment, bending_energy
from echotruth.tracking import region as region_module
from echotruth.tracking.bending_energy import bending_matrix, wall_frame
from echotruth.tracking.bspline import lattice_around
from echotruth.tracking.evidence import Match
from echotruth.tracking.ncc import NormalizedCrossCorrelation
from echotruth.tracking.region import FLOW_SMOOTHNESS, wall_region
from echotruth.tracking.trackers.bspline_dic import block_mean

MASK = np.zeros((60, 80), bool)
MASK[12:45, 15:70] = True
STEP = 9.0


@pytest.fixture
def random():
    return np.random.default_rng(5)


def dense(band):
    """Dense form of a symmetric banded matrix."""
    n, width = band.shape
    matrix = np.zeros((n, n))
    for a in range(n):
        for b in range(max(0, a - width + 1), a + 1):
            matrix[a, b] = matrix[b, a] = band[a, b - a + width - 1]
    return matrix


def test_field_is_the_tensor_product_spline_of_scipy(random):
    points = random.uniform([15, 12], [69, 44], (50, 2))
    lattice = lattice_around(np.argwhere(MASK)[:, ::-1], STEP)
    rows, columns = lattice.index.shape
    table = random.normal(size=(rows, columns))
    coefficients = np.zeros((lattice.size, 1))
    coefficients[lattice.index[lattice.index >= 0], 0] = table[lattice.index >= 0]
    knots = [
        start + lattice.knot_spacing * (np.arange(n + 4) - 2)
        for start, n in zip(lattice.origin, (columns, rows), strict=True)
    ]
    lateral, axial = (interpolate.BSpline.design_matrix(points[:, axis], knots[axis], 3).toarray() for axis in (0, 1))
    expected = np.einsum("pi,pj,ij->p", axial, lateral, table)
    np.testing.assert_allclose(lattice.evaluate(coefficients, points)[:, 0], expected, atol=1e-12)


def test_adjoint_is_the_transpose_of_the_evaluation(random):
    # Points of no order, and pixels, which lie on lines.
    for points in (random.uniform([15, 12], [69, 44], (50, 2)), np.argwhere(MASK)[:, ::-1].astype(float)):
        lattice = lattice_around(np.argwhere(MASK)[:, ::-1], STEP)
        cells, _ = lattice.sort_points(points)
        coefficients, values = random.normal(size=(lattice.size, 3)), random.normal(size=(len(points), 3))
        product = np.vdot(cells.evaluate(coefficients), values)
        assert np.vdot(coefficients, cells.adjoint(values, lattice.size)) == pytest.approx(product, rel=1e-12)


def test_robust_weight_is_a_quarter_at_the_tolerance_and_only_seen_pixels_tell_the_scale():
    residual = stats.norm.ppf((np.arange(40_000) + 0.5) / 40_000)
    seen = np.ones_like(residual)
    residual[0] = 3.0
    assert alignment.geman_mcclure(residual, 3.0, seen)[0] == pytest.approx(0.25, rel=1e-3)
    seen[1::2], residual[1::2] = 0.0, 100.0
    weight = alignment.geman_mcclure(residual, 3.0, seen)
    assert weight[0] == pytest.approx(0.25, rel=1e-3) and (weight[1::2] == 0).all()
    assert (alignment.geman_mcclure(residual, 3.0, 0 * seen) == 0).all()


def jacobian(region, gradient):
    """Derivative of the grey value of every pixel by every unknown, shape (pixel, unknowns)."""
    weights = region.cells.evaluate(np.eye(region.lattice.size))
    return (weights[:, :, None] * gradient[:, None]).reshape(len(gradient), -1)


def affine(region):
    """Coefficients of the six affine fields, by least squares from their values at the pixels."""
    position = region.positions / 80
    fields = np.column_stack([np.ones(len(position)), position])
    weights = region.cells.evaluate(np.eye(region.lattice.size))
    return np.kron(np.linalg.lstsq(weights, fields, rcond=None)[0], np.eye(2))


def test_affine_motion_of_the_whole_wall_has_no_bending_energy(random):
    region = wall_region(MASK, STEP, 3.0, 0.5)
    random_field = region.energy.gradient(random.normal(size=(2 * region.lattice.size)))
    for field in affine(region).T:
        assert np.abs(region.energy.gradient(field)).max() < 1e-9 * np.abs(random_field).max()


def test_more_of_the_motion_so_far_has_no_bending_energy(random):
    region = wall_region(MASK, STEP, 3.0, 0.5)
    so_far, other = random.normal(size=(2, 2 * region.lattice.size))
    energy = region.energy.and_without(so_far)
    size = np.abs(region.energy.gradient(so_far)).max()
    assert np.abs(energy.gradient(-0.3 * so_far)).max() < 1e-9 * size
    # Another field has the least energy that it can have with some of the motion taken from it.
    shares = np.linspace(-2, 2, 4001)
    least = min(field @ region.energy.gradient(field) for field in other - shares[:, None] * so_far)
    np.testing.assert_allclose(other @ energy.gradient(other), least, rtol=1e-5)
    assert region.energy.and_without(np.zeros_like(so_far)) is region.energy


@pytest.mark.parametrize("stride", [1, 3])
def test_normal_equations_are_those_of_the_dense_problem(random, stride):
    region = wall_region(MASK, STEP, 0.0, 0.5)
    count = len(region.positions)
    gradient, weight = random.normal(size=(count, 2)), random.uniform(size=count)
    band, cells = np.zeros(region.energy.band.shape), region.cells
    alignment.add_normal_matrix(cells.lines, gradient, weight, stride, band)
    # Every stride-th pixel of a cell counts stride times.
    index = np.arange(count) - np.repeat(cells.offsets[:-1], np.diff(cells.offsets))
    design, counted = jacobian(region, gradient), stride * weight * (index % stride == 0)
    expected = design.T @ (counted[:, None] * design)
    np.testing.assert_allclose(dense(band), expected, atol=1e-10)
    field = random.normal(size=len(band))
    np.testing.assert_allclose(bending_energy._product(band, field), expected @ field, atol=1e-9)


def test_relative_noise_is_power_over_speckle_power_times_speckle_length_over_knot_spacing(random):
    region = wall_region(MASK, STEP, 3.0, 0.5)
    wavenumber = 2 * np.pi / 6
    gradient = wavenumber * np.cos(wavenumber * region.positions)
    template, residual = (
        np.sin(wavenumber * region.positions).sum(1),
        0.2 * random.standard_normal(len(region.positions)),
    )
    weight = random.uniform(size=len(residual))
    # Power 1, gradient of power wavenumber^2 / 2 along either axis.
    expected = 0.2**2 * np.sqrt(2) / wavenumber / STEP
    match = Match(template, residual, gradient, weight)
    np.testing.assert_allclose(match.relative_noise(STEP), expected, rtol=0.1)


def test_fit_of_a_flow_becomes_that_by_least_squares_with_its_own_weights(random, monkeypatch):
    monkeypatch.setattr(region_module, "FLOW_ITERATIONS", 60)
    region = wall_region(MASK, STEP, 3.0, 0.5)
    flow = 0.02 * (region.positions - 40) + random.normal(size=region.positions.shape) * 0.1
    flow[::7] += 5
    found = region.fit(flow)
    residual = region.cells.evaluate(found) - flow
    weight = alignment.geman_mcclure(np.hypot(*residual.T), 2.0, np.ones(len(flow)))
    component = np.arange(len(flow)) % 2
    design = jacobian(region, np.eye(2)[component])
    gradient = design.T @ (weight / weight.mean() * residual[np.arange(len(flow)), component])
    energy = FLOW_SMOOTHNESS * np.diagonal(design.T @ design).mean() * dense(region.energy.band)
    fields = affine(region)
    energy -= energy @ fields @ np.linalg.solve(fields.T @ energy @ fields, fields.T @ energy)
    np.testing.assert_allclose(gradient, -energy @ found.ravel(), atol=1e-6 * np.abs(gradient).max() + 1e-6)
    assert weight[::7].max() < 0.01
    monkeypatch.undo()
    np.testing.assert_allclose(region.cells.evaluate(region.fit(flow)), region.cells.evaluate(found), atol=0.1)


def test_alignment_with_a_reused_matrix_converges_to_that_with_a_new_one_in_every_iteration(shifted, monkeypatch):
    region = wall_region(MASK, STEP, 3.0, 0.5)
    images = [
        spline.coefficients(ndimage.gaussian_filter(shifted(80, *by)[:60] / 255, 1)) for by in ([0, 0], [2.7, 1.4])
    ]
    template, start = (
        alignment.interpolate_with_gradient(images[0], region.positions)[:, 0],
        np.zeros((region.lattice.size, 2)),
    )
    monkeypatch.setattr(region_module, "CONVERGENCE", 1e-6)
    monkeypatch.setattr(region_module, "MAX_ITERATIONS", 100)
    held, fresh = (
        monkeypatch.setattr(region_module, "MATRIX_REUSE", count)
        or region.cells.evaluate(region.align(images[1], template, start, start, 2000.0, 4.0)[0])
        for count in (region_module.MATRIX_REUSE, 1)
    )
    assert np.abs(held - fresh).max() < 0.002
    np.testing.assert_allclose(held.mean(0), [2.7, 1.4], atol=0.01)


def test_coarse_image_has_the_means_of_blocks(random):
    image = random.uniform(size=(36, 48)).astype(np.float32)
    for times in (1, 2, 3):
        expected = cv2.resize(image, None, fx=1 / times, fy=1 / times, interpolation=cv2.INTER_AREA)
        np.testing.assert_allclose(block_mean(image, times), expected, atol=1e-6)
    np.testing.assert_array_equal(block_mean(image[:35, :47], 2), block_mean(image, 2)[:17, :23])


@pytest.mark.parametrize("transmural_scale", [1.0, 0.25])
def test_bending_energy_of_a_parabola_is_its_thin_plate_energy_in_the_metric(transmural_scale):
    positions = np.argwhere(MASK)[:, ::-1].astype(float)
    lattice = lattice_around(positions, STEP)
    metrics, turns = np.tile([1.0, 0.0, transmural_scale], (len(positions), 1)), np.zeros((len(positions), 5))
    band = bending_matrix(lattice.sort_points(positions)[0], metrics, turns, lattice.size)
    row, column = np.nonzero(lattice.index >= 0)

    def energy(values):
        coefficients = np.zeros((lattice.size, 2))
        coefficients[lattice.index[row, column], 1] = values
        return coefficients.ravel() @ dense(band) @ coefficients.ravel()

    along = energy(column**2)
    assert energy(3 + 2 * column - row) == pytest.approx(0, abs=1e-9 * along)
    # |M H M|^2 is 4 for x^2, 2 transmural_scale^2 for x y and 4 transmural_scale^4 for y^2.
    assert energy(column * row) / along == pytest.approx(transmural_scale**2 / 2)
    assert energy(row**2) / along == pytest.approx(transmural_scale**4)


def ring(transmural_scale):
    """Annulus: mask, pixels, their x, y and r from the centre in knot spacings, and the wall frame in closed form."""
    radius = np.hypot(*(np.indices((200, 200)) - 99.5))
    mask = (radius > 55) & (radius < 90)
    positions = np.argwhere(mask)[:, ::-1].astype(float)
    x, y = (positions - 99.5).T / STEP
    r = np.hypot(x, y)
    shortening = 1 - transmural_scale
    metrics = np.stack([1 - shortening * x * x / r**2, -shortening * x * y / r**2, 1 - shortening * y * y / r**2], -1)
    xx = 2 * x * y / r**4
    turns = np.stack([-y / r**2, x / r**2, xx, (y * y - x * x) / r**4, -xx], -1)
    return mask, positions, (x, y, r), (metrics, turns)


def test_bending_energy_of_a_ring_is_that_of_its_polar_components():
    transmural_scale = 0.5
    _, positions, (x, y, r), known = ring(transmural_scale)
    lattice = lattice_around(positions, STEP)
    cells, order = lattice.sort_points(positions)
    band = bending_matrix(cells, *(values[order] for values in known), lattice.size)
    weights = np.stack([cells.evaluate(unit[:, None])[:, 0] for unit in np.eye(lattice.size)], -1)

    angle, outwards = np.arctan2(y, x), np.stack([x, y], -1) / r[:, None]
    fields = np.hstack([radial[:, None] * outwards for radial in (r**2, np.ones_like(r), np.cos(3 * angle))])[order]
    coefficients = np.linalg.lstsq(weights.T @ weights, weights.T @ fields, rcond=1e-12)[0]
    square, even, waves = (each.ravel() @ dense(band) @ each.ravel() for each in np.split(coefficients, 3, axis=1))
    assert even < 1e-3 * square
    # D_s D_s = -9 cos(3 angle) / r^2 and D_n D_s = 3 sin(3 angle) / r^2.
    wave = np.sum((81 * np.cos(3 * angle) ** 2 + transmural_scale**2 * 9 * np.sin(3 * angle) ** 2) / r**4)
    assert waves / wave == pytest.approx(square / (4 * transmural_scale**4 * len(r)), rel=0.02)


def test_frame_of_a_ring_turns_with_its_angle():
    mask, _, _, known = ring(0.5)
    for found, expected in zip(wall_frame(mask, mask, STEP, 0.5), known, strict=True):
        np.testing.assert_allclose(found, expected, atol=0.15 * np.abs(expected).max())


def test_ncc_is_invariant_to_gain_and_offset_but_not_to_noise(random):
    positions = np.argwhere(MASK)[:, ::-1].astype(float)
    points = np.array([[40.0, 30.0], [20.0, 20.0], [5.0, 5.0]])
    ncc = NormalizedCrossCorrelation(positions, np.ones(len(positions), bool), points, 16.0, 0.0)
    first, noise = random.normal(size=(2, len(positions)))
    np.testing.assert_allclose(ncc.at_points(first, 3 * first + 2)[:2], 1, atol=1e-9)
    np.testing.assert_allclose(ncc.at_points(first, -first)[:2], -1, atol=1e-9)
    assert np.isnan(ncc.at_points(first, first)[2])
    assert np.isnan(ncc.at_points(first, 0 * first)).all()
    noisy = first + noise
    assert ncc.overall(first, noisy) == pytest.approx(np.corrcoef(first, noisy)[0, 1], abs=1e-12)
    np.testing.assert_allclose(ncc.at_points(first, noisy)[:2], np.sqrt(0.5), atol=0.15)

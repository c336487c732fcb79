"""The parts of the B-spline tracker against other libraries and closed forms."""

import cv2
import numpy as np
import pytest
from scipy import interpolate, linalg, ndimage

from echotruth.imaging import spline
from echotruth.tracking import region as region_module
from echotruth.tracking.alignment import add_matrix, factorise, grey_at, product, solve
from echotruth.tracking.bending_energy import frame, roughness
from echotruth.tracking.bspline import lattice
from echotruth.tracking.ncc import Likeness
from echotruth.tracking.region import LOOSE, region
from echotruth.tracking.trackers.bspline_dic import coarsened

MASK = np.zeros((60, 80), bool)
MASK[12:45, 15:70] = True
STEP = 9.0


@pytest.fixture
def random():
    return np.random.default_rng(5)


def dense(band):
    """Whole symmetric matrix of a band."""
    n, width = band.shape
    matrix = np.zeros((n, n))
    for a in range(n):
        for b in range(max(0, a - width + 1), a + 1):
            matrix[a, b] = matrix[b, a] = band[a, b - a + width - 1]
    return matrix


def test_field_is_the_tensor_product_spline_of_scipy(random):
    points = random.uniform([15, 12], [69, 44], (50, 2))
    net = lattice(np.argwhere(MASK)[:, ::-1], STEP)
    rows, columns = net.number.shape
    table = random.normal(size=(rows, columns))
    coefficients = np.zeros((net.size, 1))
    coefficients[net.number[net.number >= 0], 0] = table[net.number >= 0]
    axes = [net.origin[axis] + net.step * (np.arange(count + 4) - 2) for axis, count in ((0, columns), (1, rows))]
    across, down = (interpolate.BSpline.design_matrix(points[:, axis], axes[axis], 3).toarray() for axis in (0, 1))
    expected = np.einsum("pi,pj,ij->p", down, across, table)
    np.testing.assert_allclose(net.at(coefficients, points)[:, 0], expected, atol=1e-12)


def test_gathering_is_the_transpose_of_evaluating(random):
    body = region(MASK, STEP, 3.0, 0.5)
    values, coefficients = random.normal(size=(len(body.places), 2)), random.normal(size=(body.lattice.size, 2))
    there = np.sum(values * body.cells.evaluate(coefficients))
    back = np.sum(body.cells.gather(values, body.lattice.size) * coefficients)
    assert there == pytest.approx(back, rel=1e-12)


def test_knots_count_along_the_shorter_side():
    tall = lattice(np.argwhere(MASK), STEP)
    assert tall.number.shape[0] > tall.number.shape[1]
    assert np.abs(np.diff(tall.number, axis=0)).max() == tall.number.shape[1]
    assert np.abs(np.diff(lattice(np.argwhere(MASK)[:, ::-1], STEP).number, axis=1)).max() == tall.number.shape[1]


def test_grey_values_and_slopes_are_those_of_the_cubic_spline(random):
    image = random.normal(size=(30, 40)).astype(np.float32)
    place = random.uniform([1, 1], [38, 28], (60, 2))
    grey = grey_at(spline.coefficients(image), place)

    def at(moved):
        return ndimage.map_coordinates(image.astype(float), (place + moved)[:, ::-1].T, order=3, mode="mirror")

    np.testing.assert_allclose(grey[:, 0], at([0, 0]), atol=1e-5)
    for axis, step in enumerate(1e-4 * np.eye(2)):
        np.testing.assert_allclose(grey[:, 1 + axis], (at(step) - at(-step)) / 2e-4, atol=1e-4)


def forces(body, slope):
    """Change of the grey values of all pixels with every unknown, shape (pixel, unknowns)."""
    shares = body.cells.evaluate(np.eye(body.lattice.size))
    return (shares[:, :, None] * slope[:, None]).reshape(len(slope), -1)


def affine(body):
    """Coefficients of the shifts and of what is in proportion to the place, as their values at the pixels ask."""
    place = body.places / 80
    motions = np.column_stack([np.ones(len(place)), place])
    shares = body.cells.evaluate(np.eye(body.lattice.size))
    return np.kron(np.linalg.lstsq(shares, motions, rcond=None)[0], np.eye(2))


def test_shift_and_stretch_of_the_whole_are_not_rough_and_a_bend_is(random):
    body = region(MASK, STEP, 3.0, 0.5)
    bend = body._bend(random.normal(size=(2 * body.lattice.size)))
    for motion in affine(body).T:
        assert np.abs(body._bend(motion)).max() < 1e-9 * np.abs(bend).max()


@pytest.mark.parametrize("every", [1, 3])
def test_normal_equations_are_those_of_the_dense_problem(random, every):
    body = region(MASK, STEP, 0.0, 0.5)
    count = len(body.places)
    slope, weight = random.normal(size=(count, 2)), random.uniform(size=count)
    band, cells = np.zeros(body.roughness.shape), body.cells
    add_matrix(cells.knots, cells.first, cells.across, cells.down, slope, weight, every, band)
    # Every so many of the pixels of a cell count, and each for so many.
    place = np.arange(count) - np.repeat(cells.first[:-1], np.diff(cells.first))
    design, counted = forces(body, slope), every * weight * (place % every == 0)
    expected = design.T @ (counted[:, None] * design)
    np.testing.assert_allclose(dense(band), expected, atol=1e-10)
    x = random.normal(size=len(band))
    np.testing.assert_allclose(product(band, x), expected @ x, atol=1e-9)
    band[:, -1] += 1
    right, factor = x.copy(), band.copy()
    factorise(factor)
    solve(factor, right)
    np.testing.assert_allclose(right, linalg.solve(expected + np.eye(len(x)), x), atol=1e-10)


def test_noise_is_its_power_over_that_of_the_speckle_times_the_length_of_speckle_over_the_distance_of_knots(random):
    body = region(MASK, STEP, 3.0, 0.5)
    turn = 2 * np.pi / 6
    slope = turn * np.cos(turn * body.places)
    template, residual = np.sin(turn * body.places).sum(1), 0.2 * random.standard_normal(len(body.places))
    weight = random.uniform(size=len(residual))
    # Power 1, slopes of power turn^2 / 2 along either axis.
    expected = 0.2**2 * np.sqrt(2) / turn / STEP
    np.testing.assert_allclose(body._noise(template, residual, weight, slope), expected, rtol=0.1)


def test_fit_of_a_flow_becomes_that_by_least_squares_with_its_own_weights(random, monkeypatch):
    monkeypatch.setattr(region_module, "FITS", 60)
    body = region(MASK, STEP, 3.0, 0.5)
    flow = 0.02 * (body.places - 40) + random.normal(size=body.places.shape) * 0.1
    flow[::7] += 5
    found = body.fit(flow)
    residual = body.cells.evaluate(found) - flow
    weight = region_module.robust(np.hypot(*residual.T), 2)
    which = np.arange(len(flow)) % 2
    design = forces(body, np.eye(2)[which])
    gradient = design.T @ (weight / weight.mean() * residual[np.arange(len(flow)), which])
    rough = LOOSE * np.diagonal(design.T @ design).mean() * dense(body.roughness)
    whole = affine(body)
    rough -= rough @ whole @ np.linalg.solve(whole.T @ rough @ whole, whole.T @ rough)
    np.testing.assert_allclose(gradient, -rough @ found.ravel(), atol=1e-6 * np.abs(gradient).max() + 1e-6)
    assert weight[::7].max() < 0.01
    monkeypatch.undo()
    np.testing.assert_allclose(body.cells.evaluate(body.fit(flow)), body.cells.evaluate(found), atol=0.1)


def test_alignment_with_a_matrix_held_ends_where_that_with_a_matrix_of_its_own_for_every_iteration_does(
    shifted, monkeypatch
):
    body = region(MASK, STEP, 3.0, 0.5)
    images = [
        spline.coefficients(ndimage.gaussian_filter(shifted(80, *by)[:60] / 255, 1)) for by in ([0, 0], [2.7, 1.4])
    ]
    template, start = grey_at(images[0], body.places)[:, 0], np.zeros((body.lattice.size, 2))
    monkeypatch.setattr(region_module, "STILL", 1e-6)
    monkeypatch.setattr(region_module, "STEPS", 100)
    held, fresh = (
        monkeypatch.setattr(region_module, "HELD", count)
        or body.cells.evaluate(body.align(images[1], template, start, start, (2000.0, 4.0))[0])
        for count in (region_module.HELD, 1)
    )
    assert np.abs(held - fresh).max() < 0.002
    np.testing.assert_allclose(held.mean(0), [2.7, 1.4], atol=0.01)


def test_coarse_image_has_the_means_of_areas(random):
    image = random.uniform(size=(36, 48)).astype(np.float32)
    for times in (1, 2, 3):
        expected = cv2.resize(image, None, fx=1 / times, fy=1 / times, interpolation=cv2.INTER_AREA)
        np.testing.assert_allclose(coarsened(image, times), expected, atol=1e-6)
    np.testing.assert_array_equal(coarsened(image[:35, :47], 2), coarsened(image, 2)[:17, :23])


@pytest.mark.parametrize("across", [1.0, 0.25])
def test_roughness_of_a_parabola_is_its_thin_plate_energy_in_the_metric(across):
    places = np.argwhere(MASK)[:, ::-1].astype(float)
    net = lattice(places, STEP)
    metrics, turns = np.tile([1.0, 0.0, across], (len(places), 1)), np.zeros((len(places), 5))
    band = roughness(net.cells(places)[0], metrics, turns, net.size)
    row, column = np.nonzero(net.number >= 0)

    def rough(values):
        coefficients = np.zeros((net.size, 2))
        coefficients[net.number[row, column], 1] = values
        return coefficients.ravel() @ product(band, coefficients.ravel())

    along = rough(column**2)
    assert rough(3 + 2 * column - row) == pytest.approx(0, abs=1e-9 * along)
    # |M H M|^2 is 4 for x^2, 2 across^2 for x y and 4 across^4 for y^2.
    assert rough(column * row) / along == pytest.approx(across**2 / 2)
    assert rough(row**2) / along == pytest.approx(across**4)


def ring(across):
    """Pixels of an annulus, x, y and r from its centre in knots, and the frame of its wall in closed form."""
    radius = np.hypot(*(np.indices((200, 200)) - 99.5))
    mask = (radius > 55) & (radius < 90)
    places = np.argwhere(mask)[:, ::-1].astype(float)
    x, y = (places - 99.5).T / STEP
    r = np.hypot(x, y)
    less = 1 - across
    metrics = np.stack([1 - less * x * x / r**2, -less * x * y / r**2, 1 - less * y * y / r**2], -1)
    bend = 2 * x * y / r**4
    turns = np.stack([-y / r**2, x / r**2, bend, (y * y - x * x) / r**4, -bend], -1)
    return mask, places, (x, y, r), (metrics, turns)


def test_roughness_of_a_ring_is_that_of_its_polar_components():
    across = 0.5
    _, places, (x, y, r), known = ring(across)
    net = lattice(places, STEP)
    cells, order = net.cells(places)
    band = roughness(cells, *(each[order] for each in known), net.size)
    shares = np.stack([cells.evaluate(unit[:, None])[:, 0] for unit in np.eye(net.size)], -1)

    def rough(radial):
        field = (radial[:, None] * np.stack([x, y], -1) / r[:, None])[order]
        coefficients = np.linalg.lstsq(shares, field, rcond=None)[0].ravel()
        return coefficients @ product(band, coefficients)

    angle = np.arctan2(y, x)
    thickening = rough(r**2) / (4 * across**4 * len(r))
    assert rough(np.ones_like(r)) < 1e-3 * rough(r**2)
    # D_s D_s = -9 cos(3 angle) / r^2 and D_n D_s = 3 sin(3 angle) / r^2.
    wave = np.sum((81 * np.cos(3 * angle) ** 2 + across**2 * 9 * np.sin(3 * angle) ** 2) / r**4)
    assert rough(np.cos(3 * angle)) / wave == pytest.approx(thickening, rel=0.02)


def test_frame_of_a_straight_wall_is_short_across_it_and_does_not_turn():
    for turned in (False, True):
        strip = np.zeros((60, 60), bool)
        strip[20:35] = True
        strip = strip.T if turned else strip
        expected = [0.2, 0, 1] if turned else [1, 0, 0.2]
        metrics, turns = frame(strip, strip, 3.0, 0.2)
        np.testing.assert_allclose(metrics, np.tile(expected, (strip.sum(), 1)), atol=1e-9)
        np.testing.assert_allclose(turns, 0, atol=1e-9)


def test_frame_of_a_ring_turns_with_its_angle():
    mask, _, _, known = ring(0.5)
    for found, expected in zip(frame(mask, mask, STEP, 0.5), known, strict=True):
        np.testing.assert_allclose(found, expected, atol=0.15 * np.abs(expected).max())


def test_correlation_does_not_see_gain_and_offset_but_sees_noise(random):
    places = np.argwhere(MASK)[:, ::-1].astype(float)
    points = np.array([[40.0, 30.0], [20.0, 20.0], [5.0, 5.0]])
    alike = Likeness(places, np.ones(len(places), bool), points, 16.0, 0.0)
    first, noise = random.normal(size=(2, len(places)))
    np.testing.assert_allclose(alike.about_points(first, 3 * first + 2)[:2], 1, atol=1e-9)
    np.testing.assert_allclose(alike.about_points(first, -first)[:2], -1, atol=1e-9)
    assert np.isnan(alike.about_points(first, first)[2])
    assert np.isnan(alike.about_points(first, 0 * first)).all()
    noisy = first + noise
    assert alike.overall(first, noisy) == pytest.approx(np.corrcoef(first, noisy)[0, 1], abs=1e-12)
    np.testing.assert_allclose(alike.about_points(first, noisy)[:2], np.sqrt(0.5), atol=0.15)

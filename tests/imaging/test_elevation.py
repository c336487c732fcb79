"""The beam in elevation against its integral and its closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

from echotruth.config import Probe
from echotruth.imaging.flow import fresnel
from echotruth.imaging.rf.elevation import BEAM_TAIL_ENERGY, Lens
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.kernel import Band, Grid

WAVELENGTH = 1540 / 25e6


@pytest.fixture(scope="module")
def band():
    node, weight = np.polynomial.legendre.leggauss(16)
    frequency = 25e6 + 16e6 * node
    energy = weight * np.exp(-(((frequency - 25e6) / 5.3e6) ** 2))
    return Band(frequency, energy / energy.sum(), Grid(100e6, 15.0), np.zeros(16))


@pytest.fixture(scope="module")
def lens(band):
    return Lens(Probe(), 13e-3, band)


def at(beside, depth):
    return np.stack([np.zeros_like(beside), np.full_like(beside, depth), beside], axis=1)


@pytest.mark.parametrize("depth", [1.1e-3, 3.7e-3, 6.5e-3, 12e-3])
def test_table_holds_the_integral_once_its_delay_is_put_back(lens, band, depth):
    row = np.abs(lens.curvature - 1 / depth).argmin()
    columns = np.arange(0, 60, 7)
    position = at(lens.slope[columns] / lens.curvature[row], 1 / lens.curvature[row])
    for k, frequency in enumerate(band.frequency):
        exact = fresnel(Probe(elements=3), position, frequency)[1]
        delay = np.exp(-2j * np.pi * frequency * lens.delay[row, columns])
        np.testing.assert_allclose(lens.beam[row, columns, k] * delay, exact, atol=2e-6)


def test_width_in_the_focus_is_that_of_a_squared_sinc():
    """The square falls to half where sinc(y H / (wavelength F)) is 1 / sqrt(2), at 0.443."""

    def excess(y):
        return abs(fresnel(Probe(elements=3), at(np.array([y]), 6.5e-3), 25e6)[1, 0]) ** 2 - 0.5

    assert 2 * brentq(excess, 0, 0.3e-3) == pytest.approx(0.8859 * WAVELENGTH * 6.5, rel=1e-3)


def test_integral_agrees_with_plain_summation_over_the_height():
    height = (np.arange(20000) + 0.5) / 20000 * 1e-3 - 0.5e-3
    range_, y = 4e-3, 0.23e-3
    path = (y - height) ** 2 / (2 * range_) - y**2 / (2 * range_) - height**2 / (2 * 6.5e-3)
    summed = np.exp(-2j * np.pi * path / WAVELENGTH).mean()
    assert fresnel(Probe(elements=3), at(np.array([y]), range_), 25e6)[1, 0] == pytest.approx(summed, abs=1e-6)


def test_log_derivative_is_the_change_of_the_integral_with_range(lens, band):
    """Of a thin pulse, whose mean over the band is its value at the centre."""
    thin = Band(np.linspace(24.9e6, 25.1e6, 16), np.full(16, 1 / 16), band.grid, band.loss)
    lens = Lens(Probe(), 13e-3, thin)
    row, column, step = 60, 12, 0.05
    curvature, y = lens.curvature[row], lens.slope[12] / lens.curvature[60]
    low, high = (fresnel(Probe(elements=3), at(np.array([y]), 1 / (curvature + s)), 25e6)[1, 0] for s in (-step, step))
    assert lens.log_derivative[row, column] == pytest.approx(np.log(high / low) / (2 * step), rel=1e-3)


def test_scatterers_far_beside_the_plane_are_out_of_the_beam_and_those_in_it_take_one_block(lens):
    beside = at(np.array([0.0, 6e-3, -7e-3]), 6.5e-3)
    assert lens.in_beam(beside).tolist() == [True, False, False]
    assert lens.blocks_at(lens.lens_terms(beside[:1], 1540.0)[0]).tolist() == [1]


@pytest.mark.parametrize("depth", [3e-3, 5e-3, 6.5e-3, 10e-3])
def test_echoes_beyond_the_edge_of_the_beam_have_the_energy_that_may_be_left_out(lens, band, depth):
    """Summed over evenly spread elevations with the integral itself, a nearer tail than the tables'."""
    edge = depth * np.interp(1 / depth, lens.curvature, lens.edge_slope)
    beside = (np.arange(3000) + 0.5) / 3000 * depth
    response = np.array([fresnel(Probe(elements=3), at(beside, depth), frequency)[1] for frequency in band.frequency])
    energy = band.weight @ np.abs(response) ** 4
    assert 0.8 * BEAM_TAIL_ENERGY < energy[beside > edge].sum() / energy.sum() < 1.2 * BEAM_TAIL_ENERGY


def test_either_side_of_the_plane_is_alike(lens):
    beside = np.linspace(0, 1e-3, 50)
    one, other = (lens.lens_terms(at(side * beside, 5e-3), 1540.0) for side in (1, -1))
    np.testing.assert_array_equal(one[0], other[0])


def test_echoes_from_near_the_array_or_far_beside_its_plane_are_not_spread(lens):
    aside = np.array([3e-3, 0.0, 0.0])
    assert lens.spreads(at(np.array([0.0, 0.2e-3, 1.4e-3]), 6.5e-3) + aside).tolist() == [True, True, False]
    assert not lens.spreads(at(np.array([0.0]), 2e-3)).any()


HUMAN = Probe(preset="human_2_7MHz", elements=3, frequency_MHz=3.4, bandwidth=0.111)
"""Of the human array with `realism: {preset: human}`, elements in its middle."""


@pytest.fixture(scope="module")
def second_harmonic():
    return FullMatrix(HUMAN, 120e-3, harmonic=True)


def over_the_height(frequency, depth, beside):
    """Response of an element at frequencies (n,): the mean over its height along exact paths, with a perfect lens."""
    node, weight = np.polynomial.legendre.leggauss(200)
    height, focus = 7e-3 * node, 60e-3
    path = np.hypot(depth, beside - height) - np.hypot(depth, beside) - (np.hypot(focus, height) - focus)
    return np.exp(-2j * np.pi / 1540 * np.multiply.outer(frequency, path)) @ weight / 2


def response(matrix, depth, beside=0.0):
    """That of the lens to a point, from the middle element and back to it, (bins,)."""
    spectrum, point = matrix(np.array([[0.0, depth, beside]]), np.ones(1))[:, 1, 1], np.hypot(depth, beside)
    pulse = np.exp(-(((matrix.frequency - 3.4e6) / (0.111 * 3.4e6)) ** 2) * 4 * np.log(2))
    return spectrum / pulse * point**4 / depth**2 * np.exp(4j * np.pi / 1540 * matrix.frequency * point)


@pytest.mark.parametrize(
    "depth, beside, error",
    [(25e-3, 0.0, 0.1), (30e-3, 0.0, 0.05), (30e-3, 1.5e-3, 0.06), (40e-3, 0.0, 0.02), (40e-3, 1e-3, 0.03)]
    + [(60e-3, 0.0, 0.01), (60e-3, 1e-3, 0.01), (110e-3, 0.0, 0.01), (110e-3, 3e-3, 0.01)],
)
def test_harmonic_is_sent_at_half_the_frequency_and_squared(second_harmonic, depth, beside, error):
    frequency = second_harmonic.frequency
    exact = over_the_height(frequency / 2, depth, beside) ** 2 * over_the_height(frequency, depth, beside)
    found = response(second_harmonic, depth, beside)
    band = np.abs(frequency - 3.4e6) < 0.3e6
    assert np.linalg.norm((found - exact)[band]) < error * np.linalg.norm(exact[band])


def farther(frequency, response):
    """How much farther than it is a point of this response appears: where its pulse is strongest, m."""
    beyond = np.linspace(-0.3e-3, 0.3e-3, 1201)
    pulse = np.exp(-(((frequency - 3.4e6) / (0.111 * 3.4e6)) ** 2) * 4 * np.log(2))
    echo = np.exp(4j * np.pi / 1540 * np.multiply.outer(beyond, frequency)) @ (pulse * response)
    return beyond[np.abs(echo).argmax()]


@pytest.mark.parametrize(
    "depth, shift", [(22, -38), (26, 54), (30, -10), (34, 39), (38, 58), (45, 42), (60, 0), (80, -33), (110, -53)]
)
def test_a_point_appears_where_the_documentation_says_and_where_exact_paths_put_it(second_harmonic, depth, shift):
    """To 30 um where Fresnel's approximation is poor, and to 5 um from 26 mm on."""
    frequency = second_harmonic.frequency
    found = farther(frequency, response(second_harmonic, depth * 1e-3))
    exact = [over_the_height(multiple * frequency, depth * 1e-3, 0.0) for multiple in (0.5, 1)]
    assert found == pytest.approx(shift * 1e-6, abs=2e-6)
    assert found == pytest.approx(farther(frequency, exact[0] ** 2 * exact[1]), abs=30e-6 if depth < 26 else 5e-6)


@pytest.mark.parametrize("depth", [45, 50, 80, 110])
def test_near_the_focus_a_point_is_nearer_by_the_mean_path_over_the_height(second_harmonic, depth):
    """H^2 / 24 (1/F - 1/r), the mean of h^2 / 2 (1/F - 1/r), to a tenth, and to a seventh at 110 mm."""
    nearer = 14e-3**2 / 24 * (1 / 60e-3 - 1e3 / depth)
    found = farther(second_harmonic.frequency, response(second_harmonic, depth * 1e-3))
    assert -found == pytest.approx(nearer, rel=0.1 if depth < 100 else 0.15)

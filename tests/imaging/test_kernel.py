"""Least-squares kernels against the delayed pulses they stand for."""

import numpy as np
import pytest

from echotruth.imaging.rf.kernel import Band, Grid, fit, fits, offsets, stacked, window_spectrum


@pytest.fixture(scope="module", params=[0.0, 2e5])
def band(request):
    node, share = np.polynomial.legendre.leggauss(16)
    frequency = 25e6 + 16e6 * node
    energy = share * np.exp(-(((frequency - 25e6) / 5.3e6) ** 2))
    return Band(frequency, energy / energy.sum(), Grid(130e6, 20.0), request.param * node)


def reached(band, taps, blocks, fraction):
    """Spectrum of samples, relative to that of the window at the time of the echo."""
    cycles = band.grid.cycles(band.frequency, band.loss)
    late = np.exp(-np.outer(cycles, offsets(blocks) - fraction)) @ taps
    return late / window_spectrum(cycles, band.grid.sharpness)


@pytest.mark.parametrize("fraction", [0.0, 0.37, 0.99])
def test_samples_carry_an_echo_at_any_fraction_also_on_a_grid_that_is_damped(band, fraction):
    ratio = band.frequency / 25e6
    asked = (1 - 0.1 * ratio**2) * np.exp(-2j * np.pi * band.frequency * 0.5e-9)
    taps, left = fit(band, 1, fraction)
    found = reached(band, taps @ stacked(asked), 1, fraction)
    missed = np.sqrt(band.weight @ np.abs(found - asked) ** 2)
    assert missed < 1e-4
    assert np.linalg.norm(left @ stacked(asked)) == pytest.approx(missed, rel=1e-6)


def test_more_blocks_carry_longer_echoes(band):
    """Two pulses, 120 ns apart."""
    asked = 1 + np.cos(2 * np.pi * band.frequency * 60e-9) + 0j
    missed = [np.linalg.norm(fit(band, blocks, 0.3)[1] @ stacked(asked)) for blocks in (1, 2, 3)]
    assert missed[0] > 0.1
    assert missed[2] < 1e-3


def test_polynomials_pass_through_the_kernels_of_every_phase(band):
    asked = stacked(np.ones(len(band.frequency)) + 0j)
    phases = 16
    polynomials = fits(band, 2, 2, phases)
    for phase in (0, 7, phases - 1):
        rest = 0.4 / phases
        taps = np.polyval(np.moveaxis(polynomials[:, phase] @ asked, 1, 0), rest)
        exact = fit(band, 2, phase / phases + rest)[0] @ asked
        np.testing.assert_allclose(taps.ravel(), exact, atol=3e-5)

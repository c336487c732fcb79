"""Least-squares kernels against the delayed pulses they stand for."""

import numpy as np
import pytest

from echotruth.imaging.rf.kernel import (
    Band,
    Grid,
    fit_kernel,
    fit_polynomials,
    sample_offsets,
    stack_real_imaginary,
    window_spectrum,
)


@pytest.fixture(scope="module", params=[0.0, 2e5])
def band(request):
    node, weight = np.polynomial.legendre.leggauss(16)
    frequency = 25e6 + 16e6 * node
    energy = weight * np.exp(-(((frequency - 25e6) / 5.3e6) ** 2))
    return Band(frequency, energy / energy.sum(), Grid(130e6, 20.0), request.param * node)


def spectrum(band, taps, blocks, fraction):
    """Spectrum of samples, relative to that of the window at the time of the echo."""
    frequency = band.grid.complex_frequency(band.frequency, band.loss)
    shifted = np.exp(-np.outer(frequency, sample_offsets(blocks) - fraction)) @ taps
    return shifted / window_spectrum(frequency, band.grid.sharpness)


@pytest.mark.parametrize("fraction", [0.0, 0.37, 0.99])
def test_samples_carry_an_echo_at_any_fraction_also_on_a_grid_that_is_damped(band, fraction):
    ratio = band.frequency / 25e6
    target = (1 - 0.1 * ratio**2) * np.exp(-2j * np.pi * band.frequency * 0.5e-9)
    taps, residual = fit_kernel(band, 1, fraction)
    found = spectrum(band, taps @ stack_real_imaginary(target), 1, fraction)
    missed = np.sqrt(band.weight @ np.abs(found - target) ** 2)
    assert missed < 1e-4
    assert np.linalg.norm(residual @ stack_real_imaginary(target)) == pytest.approx(missed, rel=1e-6)


def test_more_blocks_carry_longer_echoes(band):
    """Two pulses, 120 ns apart."""
    target = stack_real_imaginary(1 + np.cos(2 * np.pi * band.frequency * 60e-9) + 0j)
    missed = [np.linalg.norm(fit_kernel(band, blocks, 0.3)[1] @ target) for blocks in (1, 2, 3)]
    assert missed[0] > 0.1
    assert missed[2] < 1e-3


def test_polynomials_pass_through_the_kernels_of_every_phase(band):
    target = stack_real_imaginary(np.ones(len(band.frequency)) + 0j)
    phases = 16
    polynomials = fit_polynomials(band, 2, 2, phases)
    for phase in (0, 7, phases - 1):
        rest = 0.4 / phases
        taps = np.polyval(np.moveaxis(polynomials[:, phase] @ target, 1, 0), rest)
        exact = fit_kernel(band, 2, phase / phases + rest)[0] @ target
        np.testing.assert_allclose(taps.ravel(), exact, atol=3e-5)

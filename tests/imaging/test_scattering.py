"""Echoes that follow a power of the frequency, against the exact sum and a closed form."""

import numpy as np
import pytest

from benchmarks.exact_sum import exact_matrix
from echotruth.config import Config, Probe
from echotruth.config.loading import ConfigError, validate
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.rf.full_matrix import PLANE_ACCURACY, FullMatrix
from echotruth.units import mm

DEPTH = 11e-3
PROBE = Probe()
TISSUES = np.array([0.0, 1.5, 2.0])
"""Exponents of three tissues."""


@pytest.fixture(scope="module")
def plane():
    return FullMatrix(PROBE, DEPTH, elevation=False)


def sector(number, elevation=0.0, seed=0):
    """Positions (m) and amplitudes of scatterers at random in a sector."""
    random = np.random.default_rng(seed)
    angle, range_ = np.radians(random.uniform(-32, 32, number)), random.uniform(3e-3, 10e-3, number)
    beside = random.uniform(-elevation, elevation, number)
    return np.stack([range_ * np.sin(angle), range_ * np.cos(angle), beside], axis=1), random.standard_normal(number)


def relative(estimate, exact):
    return np.linalg.norm(estimate - exact) / np.linalg.norm(exact)


def test_in_the_plane_the_rf_is_the_exact_sum_with_that_power(plane):
    """Kernels err most at the edges of the band, and the upper one is the louder the greater the power."""
    scatterers, exponent = sector(60), 4.0
    exact = exact_matrix(PROBE, *scatterers, plane.frequency[::6], exponent=exponent, elevation=False)
    assert relative(plane(*scatterers, exponent)[::6], exact) < PLANE_ACCURACY * (1 + exponent / 2)


def test_in_the_plane_tissues_with_different_powers_add_up_to_the_exact_sum(plane):
    scatterers, exponent = sector(90), np.resize(TISSUES, 90)
    exact = exact_matrix(PROBE, *scatterers, plane.frequency[::6], exponent=exponent, elevation=False)
    assert relative(plane(*scatterers, exponent)[::6], exact) < PLANE_ACCURACY * 2


@pytest.mark.slow
def test_under_the_lens_tissues_with_different_powers_add_up_to_the_exact_sum():
    """Over four draws: one of 60 scatterers errs by 1.4 to 2.2 %, by where they are."""
    probe = Probe(attenuation_dB_per_cm_MHz=0.5)
    matrix, errors, sums = FullMatrix(probe, DEPTH), [], []
    for seed in range(4):
        position, amplitude = sector(60, elevation=0.7e-3, seed=seed)
        inside = matrix.in_beam(position)
        scatterers, exponent = (position[inside], amplitude[inside]), np.resize(TISSUES, inside.sum())
        exact = exact_matrix(probe, *scatterers, matrix.frequency[::24], exponent=exponent)
        errors.append(np.linalg.norm(matrix(*scatterers, exponent)[::24] - exact))
        sums.append(np.linalg.norm(exact))
    assert np.linalg.norm(errors) < 0.016 * np.linalg.norm(sums)


def raw_moment(order, mean, variance):
    """Mean of x^order of a normal distribution: m_k = mean m_(k-1) + (k - 1) variance m_(k-2)."""
    moments = [1.0, mean]
    for k in range(2, order + 1):
        moments.append(mean * moments[-1] + (k - 1) * variance * moments[-2])
    return moments[order]


@pytest.mark.parametrize("exponent", [0.5, 2.0])
def test_the_centroid_of_an_echo_rises_as_that_of_a_gaussian_times_the_power(exponent):
    """The power spectrum f^2n exp(-(f - f0)^2 / s^2) has a ratio of moments of a normal distribution as its centroid.

    An element straight before the scatterer adds no directivity. The pulse ends at -40 dB, hence the tolerance.
    """
    matrix = FullMatrix(Probe(), DEPTH, elevation=False)
    centre, deviation = 25e6, 12.5e6 / np.sqrt(8 * np.log(2))
    echo = matrix(np.array([[matrix.centres[20], 6.5e-3, 0.0]]), np.ones(1), exponent)[:, 20, 20]
    power = np.abs(echo.astype(complex)) ** 2
    above, below = (raw_moment(int(2 * exponent) + k, 1.0, (deviation / centre) ** 2 / 2) for k in (1, 0))
    shift = matrix.frequency @ power / power.sum() / centre - 1
    assert shift == pytest.approx(above / below - 1, rel=5e-3)


def test_a_power_of_zero_leaves_every_byte_as_it_is(plane):
    position, amplitude = sector(200)
    assert plane(position, amplitude, np.zeros(200)).tobytes() == plane(position, amplitude).tobytes()


def test_lines_are_those_of_the_same_power_and_bad_powers_are_refused():
    config = Config.model_validate({"probe": {"elements": 16}, "rf": {"lines": 16, "elevation_beam": False}})
    scanner = Scanner(config.probe, config.rf, config.bmode.field_of_view_mm * mm)
    position, amplitude = sector(50)
    lines = scanner.lines(position, amplitude, 2.0)
    assert np.array_equal(lines, scanner.beamform(scanner.matrix(position, amplitude, np.full(50, 2.0))))
    with pytest.raises(ValueError, match=r"need one exponent, or exponents \(50,\)"):
        scanner.lines(position, amplitude, np.ones(49))
    with pytest.raises(ValueError, match="exponents of scatterers must be finite"):
        scanner.lines(position, amplitude, np.nan)


@pytest.mark.parametrize("key", ["phantom", "realism.blood", "realism.surroundings"])
def test_an_exponent_out_of_range_is_refused_by_the_name_of_its_key(key):
    values = {"scattering_exponent": -1.0}
    for part in reversed(key.split(".")):
        values = {part: values}
    with pytest.raises(ConfigError, match=rf"{key}\.scattering_exponent"):
        validate(values, "my.yaml")

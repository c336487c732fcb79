"""The RF against the exact sum over elements, and the laws it must keep."""

import numba
import numpy as np
import pytest

from echotruth.config import Probe
from echotruth.imaging.rf import FullMatrix

SPEED, CENTRE = 1540.0, 25e6
DEVIATION = 12.5e6 / np.sqrt(8 * np.log(2))
DEPTH = 11e-3


@pytest.fixture(scope="module")
def matrix():
    return FullMatrix(Probe(), DEPTH)


def random_scatterers(number, seed=0, elevation=0.0):
    random = np.random.default_rng(seed)
    position = np.stack(
        [
            random.uniform(-3e-3, 3e-3, number),
            random.uniform(3e-3, 9e-3, number),
            random.uniform(-elevation, elevation, number),
        ],
        axis=1,
    )
    return position, random.standard_normal(number)


def exact_spectra(position, amplitude, frequency):
    """Float64 sum over in-plane scatterers, shape (bins, elements, elements); elevation on its own quadrature."""
    centres = (np.arange(64) - 31.5) * 46e-6
    lateral = position[:, 0] - centres[:, None]
    distance = np.hypot(lateral, position[:, 1])
    argument = np.pi * 41e-6 * CENTRE / SPEED * lateral / distance
    one_way = np.sin(argument) / argument * position[:, 1] / distance / distance
    height = (np.arange(4000) + 0.5) / 4000 * 1e-3 - 0.5e-3
    defocus = 1 / np.hypot(position[:, 0], position[:, 1]) - 1 / 6.5e-3
    lens = np.exp(1j * np.pi * CENTRE / SPEED * np.outer(defocus, height**2)).mean(axis=1)
    strength = amplitude * np.abs(lens) ** 2
    spectrum = np.exp(-((frequency - CENTRE) ** 2) / (2 * DEVIATION**2))
    result = np.empty((len(frequency), 64, 64), complex)
    for k, f in enumerate(frequency):
        wave = one_way * np.exp(-2j * np.pi * f * distance / SPEED)
        result[k] = spectrum[k] * (wave * strength) @ wave.T
    return result


def relative(estimate, exact):
    return np.linalg.norm(estimate - exact) / np.linalg.norm(exact)


def test_full_matrix_is_the_exact_sum_over_scatterers(matrix):
    position, amplitude = random_scatterers(20)
    exact = exact_spectra(position, amplitude, matrix.frequency)
    assert relative(matrix(position, amplitude), exact) < 1e-3


def test_band_reaches_the_faint_edges_of_the_pulse(matrix):
    weight = np.exp(-((matrix.frequency[[0, -1]] - CENTRE) ** 2) / (2 * DEVIATION**2))
    assert (weight < 0.02).all()


def test_sending_and_receiving_can_be_swapped(matrix):
    echoes = matrix(*random_scatterers(50, elevation=3e-4))
    assert (echoes == echoes.transpose(0, 2, 1)).all()


def test_echoes_superpose(matrix):
    position, amplitude = random_scatterers(60, elevation=3e-4)
    parts = matrix(position[:25], amplitude[:25]) + matrix(position[25:], amplitude[25:])
    assert relative(matrix(position, amplitude), parts) < 1e-5


def test_echoes_are_proportional_to_the_amplitude(matrix):
    position, amplitude = random_scatterers(20)
    assert relative(matrix(position, -3 * amplitude), -3 * matrix(position, amplitude)) < 1e-6


def test_elevation_sign_does_not_matter(matrix):
    position, amplitude = random_scatterers(30, elevation=3e-4)
    assert (matrix(position, amplitude) == matrix(position * [1, 1, -1], amplitude)).all()


def test_scatterers_out_of_the_record_or_the_beam_are_left_out(matrix):
    far = np.array([[0.0, 12e-3, 0.0], [0.0, 6.5e-3, 5e-3]])
    assert len(matrix.heard(far, np.ones(2))[0]) == 0
    assert not matrix(far, np.ones(2)).any()
    kept, weight = matrix.heard(np.array([[0.0, 6.5e-3, 0.0]]), np.ones(1))
    assert len(kept) == 1
    assert weight == pytest.approx(1, abs=1e-3)


def test_bytes_do_not_depend_on_threads():
    position, amplitude = random_scatterers(5000, elevation=5e-4)
    results = []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        results.append(FullMatrix(Probe(), DEPTH)(position, amplitude).tobytes())
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    assert results[0] == results[1]


def test_a_record_beyond_the_clock_is_refused():
    with pytest.raises(ValueError, match="too long"):
        FullMatrix(Probe(), 0.4)

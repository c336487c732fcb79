"""The method of spreading as it is written to be read, against the exact sum and against the engine."""

import nonuniform_fft
import numpy as np
import pytest

from benchmarks.exact_sum import exact_matrix
from echotruth.config import Probe
from echotruth.imaging.rf import spreading
from echotruth.imaging.rf.directivity import ANGLES
from echotruth.imaging.rf.full_matrix import PLANE, PLANE_ACCURACY, FullMatrix
from echotruth.imaging.rf.kernel import TAPS
from echotruth.imaging.rf.probe import pulse_spectrum
from echotruth.imaging.rf.record import damping_rate, pulse_grid

PROBE = Probe(elements=12, attenuation_dB_per_cm_MHz=0.5)


@pytest.fixture(scope="module")
def scene():
    """Engine, and positions (m) and amplitudes of scatterers at random in a sector."""
    random = np.random.default_rng(0)
    angle, range_ = np.radians(random.uniform(-32, 32, 30)), random.uniform(3e-3, 10e-3, 30)
    position = np.stack([range_ * np.sin(angle), range_ * np.cos(angle), np.zeros(30)], axis=1)
    return FullMatrix(PROBE, 11e-3, elevation=False), position, random.standard_normal(30)


@pytest.fixture(scope="module")
def traces(scene):
    """Traces (element, element, sample) from the one-way times and the tables of the engine."""
    engine, position, amplitude = scene
    angle = engine._angle_index(position)
    propagation = np.zeros((30, 12), np.int32), *np.zeros((3, 30, 12), np.float32)
    array = engine.centres, engine._scales, engine._directivity
    spreading.one_way(position, engine._mean_exponent[angle], np.empty((0, 4)), array, propagation)
    time, weight, exponent = propagation[0] / 2.0**spreading.FRACTION_BITS, *(a.astype(float) for a in propagation[1:3])
    counts = spreading.COEFFICIENTS[PLANE]
    tables = engine._tables.reshape(ANGLES, 1 << spreading.PHASE_BITS[PLANE], sum(counts), TAPS)[angle]
    return nonuniform_fft.spread(engine.samples, amplitude, (time, weight, exponent), tables, counts)


def test_the_engine_spreads_to_the_same_traces_but_for_rounding(scene, traces):
    engine, position, amplitude = scene
    found = engine._traces(np.arange(12), position, amplitude.astype(np.float32))
    expected = traces[np.triu_indices(12)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_transformed_and_divided_by_the_window_they_are_the_exact_sum(scene, traces):
    engine, position, amplitude = scene
    frequency = engine.frequency[::6]
    loss = damping_rate(PROBE, frequency)
    spectra = nonuniform_fft.transform(traces, frequency, loss, pulse_grid(PROBE, False).grid)
    found = pulse_spectrum(PROBE, frequency)[:, None, None] * spectra
    exact = exact_matrix(PROBE, position, amplitude, frequency, elevation=False)
    assert np.linalg.norm(found - exact) < PLANE_ACCURACY * np.linalg.norm(exact)

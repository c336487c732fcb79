"""Cubic splines against those of scipy."""

import numba
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from echotruth.imaging import spline


def interpolated(samples, row, column):
    values = np.empty(len(row), np.float32)
    spline.evaluate(spline.coefficients(samples), row, column, values)
    return values


def case(rows, columns):
    random = np.random.default_rng(rows)
    row, column = (random.uniform(0, n - 1, 4000).astype(np.float32) for n in (rows, columns))
    row[:4], column[:4] = [0, 0, rows - 1, rows - 1], [0, columns - 1, 0, columns - 1]
    return random.standard_normal((rows, columns)).astype(np.float32), row, column


@pytest.mark.parametrize("shape", [(16, 20), (33, 200), (130, 1741)])
def test_values_are_those_of_scipy(shape):
    samples, row, column = case(*shape)
    expected = map_coordinates(samples.astype(float), [row, column], order=3, mode="mirror")
    assert np.abs(interpolated(samples, row, column) - expected).max() < 5e-6


def test_the_spline_goes_through_its_samples():
    samples, *_ = case(20, 30)
    row, column = (each.ravel().astype(np.float32) for each in np.indices((20, 30)))
    assert np.allclose(interpolated(samples, row, column), samples.ravel(), atol=3e-6)


def test_bytes_do_not_depend_on_threads():
    samples, row, column = case(130, 900)
    results = []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        results.append(interpolated(samples, row, column).tobytes())
    numba.set_num_threads(1)
    assert results[0] == results[1]

"""Random processes do not depend on the order of frames, and decorrelate with their time constants."""

import numpy as np
import pytest

from echotruth.config import Probe
from echotruth.imaging.medium.random_process import ar1, brownian
from echotruth.imaging.rf.full_matrix import FullMatrix

TIME = np.array([0, 3, 6, 10, 12]) * 1e-3
CONSTANT, WAVELENGTH = 8e-3, 1540 / 25e6


def random(name):
    return np.random.default_rng(list(name.encode()))


def test_frames_may_be_evaluated_in_any_order():
    processes = [ar1(np.ones(50), TIME, CONSTANT, "wall", random), brownian(50, TIME, CONSTANT, WAVELENGTH, random)]
    for process in processes:
        in_order = [process(frame).copy() for frame in range(5)]
        out_of_order = {frame: process(frame).copy() for frame in (3, 1, 4, 0, 2)}
        assert all(np.array_equal(in_order[frame], out_of_order[frame]) for frame in range(5))


def test_ar1_amplitudes_keep_their_variance():
    start = 0.3 * np.random.default_rng(1).standard_normal(200_000)
    assert ar1(start, TIME, CONSTANT, "wall", random)(4).std() == pytest.approx(0.3, rel=0.01)


@pytest.mark.parametrize("frame", [1, 4])
def test_ar1_amplitudes_correlate_as_an_exponential_of_the_time(frame):
    start = np.random.default_rng(1).standard_normal(200_000)
    process = ar1(start, TIME, CONSTANT, "wall", random)
    assert np.corrcoef(start, process(frame))[0, 1] == pytest.approx(np.exp(-TIME[frame] / CONSTANT), abs=0.01)


@pytest.fixture(scope="module")
def cloud():
    draw = np.random.default_rng(3)
    position = draw.uniform([-2e-3, 4e-3, 0], [2e-3, 9e-3, 0], (20_000, 3))
    return FullMatrix(Probe(elements=8), 10e-3, elevation=False), position, draw.standard_normal(20_000)


def correlation(a, b):
    """Of the RF with its phase."""
    return np.vdot(a, b).real / np.linalg.norm(a) / np.linalg.norm(b)


@pytest.mark.parametrize("frame", [1, 4])
def test_rf_of_diffusing_scatterers_decorrelates_with_the_time_constant(cloud, frame):
    matrix, position, amplitude = cloud
    process = brownian(len(position), TIME, CONSTANT, WAVELENGTH, random)
    echoes = [matrix(position + process(k), amplitude) for k in (0, frame)]
    assert correlation(*echoes) == pytest.approx(np.exp(-TIME[frame] / CONSTANT), abs=0.05)

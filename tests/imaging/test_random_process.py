"""Courses: the same whatever is asked first, and correlations that fall as the time constants say."""

import numpy as np
import pytest

from echotruth.config import Probe
from echotruth.imaging.medium.random_process import fading, wandering
from echotruth.imaging.rf.full_matrix import FullMatrix

TIME = np.array([0, 3, 6, 10, 12]) * 1e-3
CONSTANT, WAVELENGTH = 8e-3, 1540 / 25e6


def random(name):
    return np.random.default_rng(list(name.encode()))


def test_frames_may_be_asked_in_any_order():
    courses = [fading(np.ones(50), TIME, CONSTANT, "wall", random), wandering(50, TIME, CONSTANT, WAVELENGTH, random)]
    for course in courses:
        there = [course(frame).copy() for frame in range(5)]
        again = {frame: course(frame).copy() for frame in (3, 1, 4, 0, 2)}
        assert all(np.array_equal(there[frame], again[frame]) for frame in range(5))


def test_fading_amplitudes_keep_their_variance():
    start = 0.3 * np.random.default_rng(1).standard_normal(200_000)
    assert fading(start, TIME, CONSTANT, "wall", random)(4).std() == pytest.approx(0.3, rel=0.01)


@pytest.mark.parametrize("frame", [1, 2, 4])
def test_fading_amplitudes_correlate_as_an_exponential_of_the_time(frame):
    start = np.random.default_rng(1).standard_normal(200_000)
    course = fading(start, TIME, CONSTANT, "wall", random)
    assert np.corrcoef(start, course(frame))[0, 1] == pytest.approx(np.exp(-TIME[frame] / CONSTANT), abs=0.01)


@pytest.fixture(scope="module")
def cloud():
    draw = np.random.default_rng(3)
    place = draw.uniform([-2e-3, 4e-3, 0], [2e-3, 9e-3, 0], (20_000, 3))
    return FullMatrix(Probe(elements=8), 10e-3), place, draw.standard_normal(20_000)


def correlation(a, b):
    """Of the RF with its phase."""
    return np.vdot(a, b).real / np.linalg.norm(a) / np.linalg.norm(b)


@pytest.mark.parametrize("frame", [1, 4])
def test_rf_of_fading_scatterers_decorrelates_as_asked(cloud, frame):
    matrix, place, amplitude = cloud
    course = fading(amplitude, TIME, CONSTANT, "wall", random)
    echoes = [matrix(place, course(k)) for k in (0, frame)]
    assert correlation(*echoes) == pytest.approx(np.exp(-TIME[frame] / CONSTANT), abs=0.05)


@pytest.mark.parametrize("frame", [1, 4])
def test_rf_of_wandering_scatterers_decorrelates_as_asked(cloud, frame):
    matrix, place, amplitude = cloud
    course = wandering(len(place), TIME, CONSTANT, WAVELENGTH, random)
    echoes = [matrix(place + course(k), amplitude) for k in (0, frame)]
    assert correlation(*echoes) == pytest.approx(np.exp(-TIME[frame] / CONSTANT), abs=0.05)

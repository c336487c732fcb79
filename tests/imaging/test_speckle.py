"""Statistics of speckle."""

import numpy as np
import pytest
from scipy.stats import kstest

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.scanner import Scanner

LOW, HIGH = np.array([-1.9e-3, 5.4e-3]), np.array([1.9e-3, 7.6e-3])


@pytest.fixture(scope="module")
def fine():
    return Scanner(Probe(), Rf(lines=61, sector_deg=24), 8e-3)


def sheet(seed, density):
    """Scatterers in the image plane (density per square metre), as strong as each other and of either sign."""
    random = np.random.default_rng(seed)
    number = int(density * np.prod(HIGH - LOW))
    position = np.column_stack([random.uniform(LOW, HIGH, (number, 2)), np.zeros(number)])
    return position, random.choice([-1.0, 1.0], number)


def fan(seed, number):
    """Scatterers evenly spread over a part of a sector in the image plane, of either sign."""
    random = np.random.default_rng(seed)
    reach = np.sqrt(random.uniform(4.7e-3**2, 8.3e-3**2, number))
    angle = np.radians(random.uniform(-38, 38, number))
    position = np.column_stack([reach * np.sin(angle), reach * np.cos(angle), np.zeros(number)])
    return position, random.choice([-1.0, 1.0], number)


@pytest.mark.slow
def test_dense_speckle_is_fully_developed():
    """Envelope Rayleigh: mean over standard deviation sqrt(pi / (4 - pi)) = 1.91 (Wagner 1983).

    Sixteen elements have a beam 0.8 mm wide: twenty-five scatterers a resolution cell. Every fifth line and fifteenth
    sample are independent, two widths apart.
    """
    scanner = Scanner(Probe(elements=16), Rf(lines=21, sector_deg=56), 9e-3)
    depth = np.flatnonzero((scanner.range > 5e-3) & (scanner.range < 8e-3))[::15]
    sample = np.stack([np.abs(scanner.lines(*fan(seed, 18000)))[::5, depth] for seed in range(24)])
    power = (sample**2).mean(axis=0)
    sample = (sample / np.sqrt(np.outer(power.mean(axis=1), power.mean(axis=0)) / power.mean())).ravel()
    assert len(sample) == 24 * 5 * 26
    assert sample.mean() / sample.std() == pytest.approx(np.sqrt(np.pi / (4 - np.pi)), abs=0.03)
    assert kstest(sample, "rayleigh", args=(0, 1 / np.sqrt(2))).pvalue > 0.05


@pytest.mark.slow
def test_sparse_speckle_has_the_kurtosis_of_its_density(fine):
    """<I^2> / <I>^2 = 2 + 1 / (density * area), the area from the lines of a point (Jakeman 1980)."""
    depth = np.flatnonzero((fine.range > 6e-3) & (fine.range < 7e-3))
    point = np.abs(fine.lines(np.array([[0.0, 6.5e-3, 0]]), np.ones(1))) ** 2
    area = point.sum() ** 2 / (point**2).sum() * 6.5e-3 * np.radians(0.4) * (fine.range[1] - fine.range[0])
    density = 2 / area
    intensity = np.stack([np.abs(fine.lines(*sheet(seed, density)))[:, depth] ** 2 for seed in range(20)])
    mean = intensity.mean(axis=(0, 2), keepdims=True)
    found = ((intensity / mean) ** 2).mean()
    assert found == pytest.approx(2.5, rel=0.06)

import numpy as np
import pytest

from echotruth.tracking import evidence
from echotruth.tracking.evidence import Match, effective_parameters, energy_weight


@pytest.fixture
def random():
    return np.random.default_rng(4)


def log_evidence(beta, image, energy, data, variance):
    """Of data = step + noise, whose variances are v / beta / K and v / N, one unknown each, up to a constant."""
    total = variance / image + variance / (beta * energy)
    return -0.5 * np.sum(np.log(total) + data**2 / total)


def test_effective_parameters_are_those_of_independent_unknowns(random):
    image, energy = random.uniform(0.1, 10, 40), random.uniform(0.1, 10, 40)
    energy[:6] = 0
    probes = random.choice([-1.0, 1.0], size=(2, 40))
    found = effective_parameters(3.0, lambda rhs: rhs / (image + 3 * energy)[:, None], probes, probes * energy)
    assert found == pytest.approx((image / (image + 3 * energy))[6:].sum())


def test_weight_settles_where_the_evidence_is_greatest(random, monkeypatch):
    monkeypatch.setattr(evidence, "PRIOR_UNKNOWNS", 0.0)
    image, energy, variance = random.uniform(1, 10, 400), random.uniform(1, 10, 400), 0.3
    energy[:6] = 0
    step = random.normal(size=400) * np.sqrt(variance / 5 / np.where(energy, energy, np.inf))
    data = step + random.normal(size=400) * np.sqrt(variance / image)
    probes, beta = random.choice([-1.0, 1.0], size=(1, 400)), 1.0
    for _ in range(200):
        fitted = image * data / (image + beta * energy)
        effective = effective_parameters(
            beta, lambda rhs, beta=beta: rhs / (image + beta * energy)[:, None], probes, probes * energy
        )
        beta = energy_weight(variance, effective, float(fitted @ (energy * fitted)), 1.0)
    grid = np.geomspace(0.5, 50, 2001)
    values = [log_evidence(trial, image[6:], energy[6:], data[6:], variance) for trial in grid]
    assert beta == pytest.approx(grid[np.argmax(values)], rel=3e-3)
    assert 2.5 < beta < 10


def test_weight_of_a_step_without_energy_is_that_of_its_prior():
    assert energy_weight(2.0, 0.0, 0.0, 3.0) == pytest.approx(2.0 / (evidence.UNEVENNESS * 3.0))
    assert not np.isfinite(energy_weight(2.0, 0.0, 0.0, 0.0))


def test_correlation_area_is_that_of_a_gaussian_texture(random):
    from scipy import ndimage

    length, size = 4.0, 400
    # White noise blurred with l / sqrt(2) has the correlation exp(-x^2 / 2 l^2).
    texture = ndimage.gaussian_filter(random.standard_normal((size, size)), length / np.sqrt(2), mode="wrap")
    gradient = np.stack(np.gradient(texture)[::-1], -1).reshape(-1, 2)
    residual = random.standard_normal(texture.size)
    match = Match(texture.ravel(), residual, gradient, np.ones(texture.size))
    expected = evidence.NOISE_AREA * 2 * np.pi * length**2
    assert match.variance(1.0) == pytest.approx(expected, rel=0.1)
    assert match.variance(0.5) == pytest.approx(expected / 2, rel=0.1)

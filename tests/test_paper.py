"""What the page about the paper concludes from incompressibility."""

from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@pytest.fixture
def paper(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    import paper_heart

    return paper_heart


def test_no_isochoric_wall_has_a_smaller_mean_strain_than_the_least(paper):
    random = np.random.default_rng(1)
    for spread in (0.02, 0.1, 0.3):
        gradient = np.eye(3) + spread * random.standard_normal((500, 3, 3))
        gradient = gradient[np.linalg.det(gradient) > 0.1]
        gradient /= np.cbrt(np.linalg.det(gradient))[:, None, None]
        mean = (np.diagonal(np.swapaxes(gradient, 1, 2) @ gradient, axis1=1, axis2=2).mean(0) - 1) / 2
        assert mean[2] > paper.least_strain(mean[0], mean[1])


def test_the_least_strain_is_that_of_a_uniform_wall_without_shear(paper):
    stretch = np.array([1.25, 0.8, 1.0])
    first, second, third = (stretch**2 - 1) / 2
    assert paper.least_strain(first, second) == pytest.approx(third, abs=1e-15)


def test_a_thin_tube_contracts_as_its_cavity(paper):
    shortened = np.sqrt(1 - 2 * 0.06)
    radial, around = paper.tube_strain(1.0, 0.4, 1e-9, -0.06)
    assert around == pytest.approx((0.6 / shortened - 1) / 2, rel=1e-6)
    assert radial == pytest.approx((1 / (0.6 * shortened) - 1) / 2, rel=1e-6)


def test_a_thick_tube_that_only_shortens_widens_its_wall(paper):
    # An affine motion: without ejection beyond that of shortening, all radii grow by the same factor.
    axial = np.sqrt(1 - 2 * 0.06)
    found = paper.tube_strain(1.0, 0.0, 0.8, -0.06)
    assert found == pytest.approx([(1 / axial - 1) / 2] * 2, rel=1e-9)

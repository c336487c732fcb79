"""Statistics over masks: compared with numpy and scipy, and NaN where there is nothing but rounding."""

import numpy as np
import pytest
from scipy.stats import pearsonr

from echotruth.evaluation import statistics

MASKS = np.array([np.arange(40) < 40, np.arange(40) % 3 == 0, np.arange(40) < 1, np.arange(40) < 0])


@pytest.fixture
def values():
    """Two correlated values, (2, point, 1), some of them NaN."""
    random = np.random.default_rng(0)
    first = random.normal(3, 1, (40, 1))
    pair = np.stack([first, first + random.normal(0, 0.5, (40, 1))])
    pair[0, 4], pair[1, 9] = np.nan, np.nan
    return pair


def test_moments_are_those_of_numpy_over_the_points_that_are_known(values):
    kept = values[0, MASKS[1] & np.isfinite(values[0, :, 0]), 0]
    expected = {"mean": kept.mean(), "rms": np.sqrt(np.mean(kept**2)), "standard_deviation": kept.std()}
    for name, number in expected.items():
        found = getattr(statistics, name)(values[0], MASKS)[:, 0]
        assert found[1] == pytest.approx(number, rel=1e-12), name
        assert np.isnan(found[3])
    assert np.isnan(statistics.standard_deviation(values[0], MASKS)[2, 0])


def test_correlation_is_that_of_scipy_over_the_points_at_which_both_are_known(values):
    known = np.isfinite(values).all((0, 2))
    found = statistics.correlation(*values, MASKS, 0.0)[:, 0]
    for k in (0, 1):
        expected = pearsonr(*values[:, MASKS[k] & known, 0]).statistic
        assert found[k] == pytest.approx(expected, abs=1e-12) and expected > 0.5
    assert np.isnan(found[2:]).all()


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_correlation_has_no_unit(values, scale):
    expected = statistics.correlation(*values, MASKS, 0.0)
    np.testing.assert_allclose(statistics.correlation(scale * values[0], values[1], MASKS, 0.0), expected, rtol=1e-9)


def test_the_same_value_rounded_at_every_point_correlates_with_nothing(values):
    # Single precision keeps 24 bits, so that a third is known to 1.5e-8.
    rounded = 1 / 3 + np.random.default_rng(1).uniform(-1.5e-8, 1.5e-8, (40, 1))
    for pair in ((rounded, values[1]), (values[0], rounded), (rounded, rounded), (np.zeros((40, 1)), values[1])):
        assert np.isnan(statistics.correlation(*pair, MASKS, 0.0)).all()
    large = 1 / 3 + 1e-3 * values
    np.testing.assert_allclose(
        statistics.correlation(*large, MASKS, 0.0), statistics.correlation(*values, MASKS, 0.0), rtol=1e-9
    )


def test_values_that_vary_less_than_the_rounding_given_correlate_with_nothing(values):
    tiny = 5e-15 * (values[0] - 3)
    assert np.isnan(statistics.correlation(tiny, values[1], MASKS, 1e-6)).all()
    expected = statistics.correlation(*values, MASKS, 0.0)[:2]
    np.testing.assert_allclose(statistics.correlation(tiny, 1e10 * values[1], MASKS, 1e-15)[:2], expected, rtol=1e-9)

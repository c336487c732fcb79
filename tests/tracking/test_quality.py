"""Quality as a probability: against simulated errors, and in its limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from echotruth.config.tracking import METHODS, OUTSIDE, Dis, PhaseCorrelation
from echotruth.tracking.accumulation import Path
from echotruth.tracking.quality import ERRORS, ErrorModel, error_model, within

MODEL = ErrorModel(constant=0.3, pixel=0.2, correlation=0.5, pixel_correlation=0.1, disagreement=0.6, motion=0.05)


def path(variance, disagreement=np.nan, displacement=(3.0, 4.0)):
    """Path of one point in two frames, with zeros in frame 0."""
    moved = np.array([[[0.0, 0.0]], [displacement]])
    return Path(moved, *(np.array([[first], [value]]) for first, value in ((1, 0.9), (0, variance), (0, disagreement))))


def test_probability_is_that_of_the_length_of_a_gaussian_error_in_the_plane():
    """Against the chi-squared distribution of its square."""
    deviation = np.array([0.1, 0.7, 3.0])
    expected = stats.chi2.cdf((1.3 / deviation) ** 2, 2)
    np.testing.assert_allclose(within(1.3, deviation**2), expected, rtol=1e-12)


def test_points_with_the_stated_probability_are_within_the_distance_that_often():
    """A million errors in an image of 64 x 128 px, where 1/256 of the side is half a pixel."""
    random, count = np.random.default_rng(1), 1_000_000
    side = 256 / 128
    squared = 0.3**2 + (0.2 * side) ** 2 + (0.5**2 + (0.1 * side) ** 2) * 0.4 + (0.6 * side * 0.2) ** 2
    error = np.sqrt(squared + (0.05 * side * 5) ** 2) * random.standard_normal((2, count))
    quality = MODEL.probability(path(0.4, 0.2), (64, 128))[1, 0]
    assert abs(np.mean(np.hypot(*error) < 1) - quality) < 4 * np.sqrt(quality * (1 - quality) / count)


def test_quality_is_one_at_end_diastole_and_falls_with_every_sign_of_error():
    best = MODEL.probability(path(0.1, 0.1, (1.0, 0.0)), (256, 256))
    assert best[0, 0] == 1 and 0 < best[1, 0] < 1
    for worse in (path(0.3, 0.1, (1.0, 0.0)), path(0.1, 0.5, (1.0, 0.0)), path(0.1, 0.1, (9.0, 0.0))):
        assert MODEL.probability(worse, (256, 256))[1, 0] < best[1, 0]


def test_one_way_alone_has_no_disagreement_and_a_lost_way_has_no_certainty():
    alone, none = MODEL.probability(path(0.1), (256, 256)), MODEL.probability(path(0.1, 0.0), (256, 256))
    assert alone[1, 0] == none[1, 0]
    assert MODEL.probability(path(np.inf), (256, 256))[1, 0] == 0


def test_point_that_is_not_seen_is_as_sure_as_its_displacement_is_small():
    model = replace(MODEL, unseen=0.2)
    seen, hidden = path(0.1, 0.1), replace(path(0.1, 0.1), unseen=np.array([[0.0], [1.0]]))
    expected = -2 * np.log(1 - MODEL.probability(seen, (256, 256))[1, 0])
    found = -2 * np.log(1 - model.probability(hidden, (256, 256))[1, 0])
    assert 1 / found == pytest.approx(1 / expected + (0.2 * 5) ** 2, rel=1e-9)
    assert model.probability(seen, (256, 256))[1, 0] == MODEL.probability(seen, (256, 256))[1, 0]


def test_lost_point_has_no_quality():
    assert np.isnan(MODEL.probability(path(0.1, displacement=(np.nan, np.nan)), (256, 256))[1, 0])


def test_every_method_of_ours_has_a_fitted_distribution():
    for section in METHODS:
        if section not in OUTSIDE:
            assert error_model(section()) in ERRORS.values()
    assert error_model(PhaseCorrelation(reference="ED")) is not error_model(PhaseCorrelation(reference="previous"))
    assert error_model(Dis(preset="fine")) is not error_model(Dis(preset="fast"))

"""Quality as a probability: against simulated errors, and in its limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage, stats

from echotruth.config.tracking import METHODS, OUTSIDE, Dis, PhaseCorrelation
from echotruth.tracking.accumulation import Path
from echotruth.tracking.quality import ERRORS, ErrorModel, error_model, within
from echotruth.tracking.speckle import speckle_length

MODEL = ErrorModel(speckle=0.3, prior=0.9, disagreement=0.6, wall=0.2, motion=0.05)
SPECKLE = 1.5


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
    noise = 0.4 * (0.3 * SPECKLE * side) ** 2
    squared = 1 / (1 / noise + 1 / 0.9**2) + (0.6**2 + 0.2**2) * (side * 0.2) ** 2
    error = np.sqrt(squared + (0.05 * side * 5) ** 2) * random.standard_normal((2, count))
    quality = MODEL.probability(path(0.4, 0.2), SPECKLE, (64, 128))[1, 0]
    assert abs(np.mean(np.hypot(*error) < 1) - quality) < 4 * np.sqrt(quality * (1 - quality) / count)


def test_quality_is_one_at_end_diastole_and_falls_with_every_sign_of_error():
    best = MODEL.probability(path(0.1, 0.1, (1.0, 0.0)), SPECKLE, (256, 256))
    assert best[0, 0] == 1 and 0 < best[1, 0] < 1
    for worse in (path(0.3, 0.1, (1.0, 0.0)), path(0.1, 0.5, (1.0, 0.0)), path(0.1, 0.1, (9.0, 0.0))):
        assert MODEL.probability(worse, SPECKLE, (256, 256))[1, 0] < best[1, 0]


def test_one_way_alone_has_no_disagreement_and_two_cannot_disagree_by_more_than_the_motion():
    alone, none = (MODEL.probability(path(0.1, apart), SPECKLE, (256, 256)) for apart in (np.nan, 0.0))
    assert alone[1, 0] == none[1, 0]
    far, farther = (MODEL.probability(path(0.1, apart), SPECKLE, (256, 256)) for apart in (5.0, 50.0))
    assert far[1, 0] == farther[1, 0] < none[1, 0]


def test_point_is_less_sure_where_the_ways_of_others_differ():
    moved, ones = np.full((2, 3, 2), 3.0), np.ones((2, 3))
    apart = np.array([[0, 0, 0], [0.4, 0.4, np.nan]]), np.array([[0, 0, 0], [0.4, 3.0, np.nan]])
    alike, unlike = (MODEL.probability(Path(moved, ones, 0.1 * ones, d), SPECKLE, (256, 256))[1] for d in apart)
    assert unlike[0] < alike[0] and unlike[2] < alike[2]


def test_where_images_are_not_alike_the_prior_limits_the_error():
    limit = 0.9**2 + (0.05 * 5) ** 2
    lost = MODEL.probability(path(np.inf), SPECKLE, (256, 256))[1, 0]
    assert lost == pytest.approx(within(1.0, np.array(limit)))
    assert MODEL.probability(path(1e6), SPECKLE, (256, 256))[1, 0] == pytest.approx(lost, rel=1e-5)


@pytest.mark.parametrize(("lateral", "axial"), [(2.5, 1.5), (2.0, 2.0)])
def test_speckle_length_is_that_of_the_correlation(lateral, axial):
    """A Gaussian field blurred by b correlates as exp(-x^2 / 4 b^2), so that l is sqrt(2) b."""
    field = ndimage.gaussian_filter(np.random.default_rng(1).normal(size=(512, 512)), (axial, lateral))
    grey = 0.8 + 0.02 * field / field.std()  # of a range so small that its amplitude is linear
    frame = np.clip(255 * grey, 0, 255)
    frame[0, :2] = 0, 255
    mask = np.ones(frame.shape, bool)
    found = speckle_length(frame.astype(np.float64), mask)
    assert found == pytest.approx(np.sqrt(lateral**2 + axial**2), rel=0.06)


def test_image_without_texture_has_speckle_of_a_pixel():
    assert speckle_length(np.zeros((64, 64), np.uint8), np.ones((64, 64), bool)) == 1
    assert speckle_length(np.zeros((64, 64), np.uint8), np.zeros((64, 64), bool)) == 1


def test_point_that_is_not_seen_is_as_sure_as_its_displacement_is_small():
    model = replace(MODEL, unseen=0.2)
    seen, hidden = path(0.1, 0.1), replace(path(0.1, 0.1), unseen=np.array([[0.0], [1.0]]))
    expected = -2 * np.log(1 - MODEL.probability(seen, SPECKLE, (256, 256))[1, 0])
    found = -2 * np.log(1 - model.probability(hidden, SPECKLE, (256, 256))[1, 0])
    assert 1 / found == pytest.approx(1 / expected + (0.2 * 5) ** 2, rel=1e-9)
    assert model.probability(seen, SPECKLE, (256, 256))[1, 0] == MODEL.probability(seen, SPECKLE, (256, 256))[1, 0]


def test_deviation_that_a_tracker_tells_adds_to_its_other_terms():
    model, silent = replace(MODEL, stated=0.5), path(0.1, 0.1)
    telling = replace(silent, deviation=np.array([[0.0], [0.7]]))
    expected = MODEL.probability(silent, SPECKLE, (128, 128))[1, 0]
    spread = [-1 / (2 * np.log1p(-each)) for each in (expected, model.probability(telling, SPECKLE, (128, 128))[1, 0])]
    assert spread[1] == pytest.approx(spread[0] + (0.5 * 0.7 * 2) ** 2, rel=1e-9)
    assert model.probability(silent, SPECKLE, (128, 128))[1, 0] == pytest.approx(expected)


def test_lost_point_has_no_quality():
    assert np.isnan(MODEL.probability(path(0.1, displacement=(np.nan, np.nan)), SPECKLE, (256, 256))[1, 0])


def test_every_method_of_ours_has_a_fitted_distribution():
    for section in METHODS:
        if section not in OUTSIDE:
            assert error_model(section()) in ERRORS.values()
    assert error_model(PhaseCorrelation(reference="ED")) is not error_model(PhaseCorrelation(reference="previous"))
    assert error_model(Dis(preset="fine")) is not error_model(Dis(preset="fast"))

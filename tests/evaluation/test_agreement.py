"""Comparison of strains: values worked by hand, and by another library."""

import numpy as np
import pytest

from echotruth.evaluation.agreement import compare, limits_of_agreement
from echotruth.evaluation.displacement_error import WallPoints

COUNT = 60
LAYER, SEGMENT = np.tile(np.arange(1, 7), 10), np.repeat(np.arange(7, 12), 12)
WALL = WallPoints(np.zeros((COUNT, 2)), LAYER, SEGMENT, np.zeros(2), "short_axis")


def column(*values):
    return np.array(values)[:, None]


def test_limits_of_agreement_are_those_worked_by_hand():
    # Differences -0.01, -0.03, +0.03: mean -1/300, standard deviation sqrt(0.0014 / 1.5).
    found = limits_of_agreement(column(-0.18, -0.20, -0.14), column(-0.17, -0.17, -0.17))[:, 0]
    np.testing.assert_allclose(found[:3], [-0.0033333, -0.0632123, 0.0565456], atol=1e-6)
    assert np.isnan(found[3])


def test_segments_that_are_not_there_count_for_nothing():
    whole = limits_of_agreement(column(1.0, 2.0, 4.0), column(1.0, 3.0, 4.0))
    np.testing.assert_array_equal(limits_of_agreement(column(1.0, np.nan, 2.0, 4.0), column(1.0, 7.0, 3.0, 4.0)), whole)
    assert np.isnan(limits_of_agreement(column(1.0, np.nan), column(2.0, 3.0))[1:]).all()


@pytest.fixture
def strains():
    """Tracked strain and three references, (frame, point, 3) and (3, frame, point, 3)."""
    random = np.random.default_rng(0)
    true = random.normal(size=(3, 4, COUNT, 3))
    return true[2] + 0.3 * random.normal(size=true[2].shape), true


def test_a_constant_error_is_bias_and_leaves_the_correlation(strains):
    _, true = strains
    found = compare(true[0] + [0.1, -0.2, 0.05], true, WALL, 2)
    np.testing.assert_allclose(found["strain_bias"][0], np.tile([0.1, -0.2, 0.05], (7, 1)))
    np.testing.assert_allclose(found["strain_rms"][0], np.tile([0.1, 0.2, 0.05], (7, 1)))
    np.testing.assert_allclose(found["strain_correlation"][0], 1)
    np.testing.assert_allclose(found["frame_strain_rms"][0], np.tile([0.1, 0.2, 0.05], (4, 1)))
    np.testing.assert_allclose(found["segment_strain_error"][0], [0.1, 0.2, 0.05])
    np.testing.assert_allclose(found["segment_agreement"][0, 2] - found["segment_agreement"][0, 1], 0, atol=1e-12)


def test_parts_of_the_error_add_up(strains):
    tracked, true = strains
    whole = compare(tracked, true, WALL, 1)["strain_bias"]
    shown, smoothed = (compare(true[k], true, WALL, 1)["strain_bias"] for k in (1, 2))
    np.testing.assert_allclose(whole[0], shown[0] + smoothed[1] + whole[2], atol=1e-12)

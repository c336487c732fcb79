"""Simultaneous intervals of ratios and the ranks that they allow, beside a brute-force test and simulated trackers."""

from itertools import product

import numpy as np
import pytest

from echotruth.evaluation.paired_ratios import LEAST_HEARTS, pairs, rank_ranges, simultaneous_intervals

NOISES = {
    "normal": lambda random, shape: random.normal(0, 0.22 / np.sqrt(2), shape),
    "heavy tails": lambda random, shape: 0.1 * random.standard_t(3, shape),
    "failures": lambda random, shape: random.normal(0, 0.15, shape) + np.log(8) * (random.random(shape) < 0.1),
}
"""Of the logarithm of a score; one of sqrt(2) 0.22 / sqrt(2) is that of a ratio."""


def p_value(differences, comparison, value):
    """Of one true value of a comparison by all signs, one by one, with the t of textbooks; others have their means."""
    centre = differences.mean(axis=0)
    centre[comparison] = value
    at_value = differences - centre

    def t(sample):
        with np.errstate(divide="ignore"):
            return np.abs(sample.mean(axis=0)) / (sample.std(axis=0, ddof=1) / np.sqrt(len(sample)))

    observed = t(at_value)[comparison]
    flipped = [t(at_value * np.array(signs)[:, None]).max() for signs in product([1, -1], repeat=len(differences))]
    return np.mean(np.array(flipped) >= observed * (1 - 1e-9))


@pytest.mark.parametrize(("hearts", "comparisons"), [(6, 1), (7, 3), (9, 3)])
def test_interval_holds_the_values_that_a_test_by_all_signs_does_not_reject(hearts, comparisons):
    differences = np.random.default_rng(hearts).normal(0.3, 0.2, (hearts, comparisons))
    found = simultaneous_intervals(differences)
    for k in range(comparisons):
        for end, outwards in ((found.low[k], -1), (found.high[k], 1)):
            step = 1e-6 * outwards
            assert p_value(differences, k, end - step) > 0.05 >= p_value(differences, k, end + step)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize(("hearts", "samples"), [(8, 1000), (12, 300), pytest.param(48, 100, marks=pytest.mark.slow)])
def test_equal_trackers_are_ordered_in_five_of_a_hundred_boards_at_most(noise, hearts, samples):
    random, ordered = np.random.default_rng(1), 0
    for _ in range(samples):
        hard = random.normal(0, 1, (hearts, 1))  # all trackers find some hearts hard
        first, last = rank_ranges(hard + NOISES[noise](random, (hearts, 8)))
        ordered += np.any(first > 1) or np.any(last < 8)
    # Three standard deviations of the share above 5 %.
    assert ordered / samples <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / samples)


def test_intervals_of_all_pairs_hold_all_true_ratios_in_95_of_100_samples():
    random, effects, samples, held = np.random.default_rng(2), np.array([0, 0, 0.1, 0.3, 2.0]), 1000, 0
    one, other = pairs(5)
    for _ in range(samples):
        scores = effects + NOISES["normal"](random, (10, 5))
        _, low, high = simultaneous_intervals(scores[:, one] - scores[:, other])
        truth = effects[one] - effects[other]
        held += np.all((low <= truth) & (truth <= high))
    assert 0.94 <= held / samples <= 0.98


def test_hearts_too_few_for_five_percent_order_nobody_and_one_more_orders():
    better, worse = np.linspace(1, 2, LEAST_HEARTS), np.linspace(11, 14, LEAST_HEARTS)
    scores = np.column_stack([better, worse])
    assert np.array(rank_ranges(scores)).tolist() == [[1, 2], [1, 2]]
    few = simultaneous_intervals((scores[:, :1] - scores[:, 1:])[:-1])
    assert np.array(rank_ranges(scores[:-1])).tolist() == [[1, 1], [2, 2]] and np.isinf([few.low, few.high]).all()


@pytest.mark.filterwarnings("error")
def test_no_heart_has_no_mean_and_no_end():
    found = simultaneous_intervals(np.empty((0, 3)))
    assert np.isnan(found.mean).all() and (found.low == -np.inf).all() and (found.high == np.inf).all()


def test_ranges_of_ranks_leave_room_for_those_that_are_not_told_apart():
    random = np.random.default_rng(3)
    hearts = random.normal(3, 1, 24)
    columns = [hearts + gain + 0.05 * random.normal(size=24) for gain in (0.0, 0.4, 0.4, 0.9)]
    scores = np.column_stack([columns[3], columns[1], np.where(np.arange(24) == 3, np.nan, 0), columns[2], columns[0]])
    first, last = rank_ranges(scores)
    np.testing.assert_array_equal(first, [4, 2, np.nan, 2, 1])
    np.testing.assert_array_equal(last, [4, 3, np.nan, 3, 1])


def test_mean_does_not_depend_on_units_and_equal_scores_are_no_difference():
    found = simultaneous_intervals(np.column_stack([np.zeros(7), np.log([2, 8, 4, 4, 2, 8, 4])]))
    assert found.ratios[:, 0].tolist() == [1, 1, 1] and found.ratios[0, 1] == pytest.approx(4)
    assert found.ratios[1, 1] > 1

"""Intervals over hearts, paired differences of trackers, and the ranks that they allow."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.suite.comparison import by_heart, paired, standing
from echotruth.evaluation.resampling import draws, interval, ranks


def table(**values):
    """Hearts as rows and trackers as columns."""
    return pd.DataFrame({name: np.asarray(each, float) for name, each in values.items()})


def test_interval_of_two_hearts_is_the_whole_range():
    # Each heart is drawn twice in a quarter of the draws: more than 2.5 %.
    low, high = interval(np.array([[1.0], [3.0]]), draws(2, 0))
    assert low == 1 and high == 3


def test_interval_of_many_hearts_is_that_of_normal_theory():
    values = np.random.default_rng(1).normal(5, 2, (400, 1))
    low, high = interval(values, draws(400, 1))
    expected = values.mean() + 1.96 * values.std() / 20 * np.array([-1, 1])
    np.testing.assert_allclose([low[0], high[0]], expected, atol=0.02)


@pytest.mark.parametrize("statistic", ["mean", "median"])
def test_interval_of_24_normal_hearts_holds_the_truth_in_some_95_of_100_samples(statistic):
    values = np.random.default_rng(7).normal(3, 2, (24, 400))
    low, high = interval(values, draws(24, 1), statistic)
    # Of 400 samples, the share itself varies by 0.011.
    assert 0.90 <= np.mean((low <= 3) & (high >= 3)) <= 0.985


def test_equal_trackers_share_a_rank():
    np.testing.assert_array_equal(ranks(np.array([3.0, 1.0, 1.0, 2.0, np.nan])), [4, 1, 1, 3, np.nan])


def test_trackers_have_ranks_of_their_own_where_their_paired_intervals_do_not_reach_zero():
    found = standing(
        table(b=[4, 9, 4, 9, 5, 7], a=[1, 2, 3, 2, 1, 2], c=[9, 4, 9, 4, 6, 6.5], d=[50, 51, 52, 53, 54, 55])
    )
    assert list(found.index) == ["a", "b", "c", "d"]
    assert found[["rank_first", "rank_last"]].to_numpy().tolist() == [[1, 1], [2, 3], [2, 3], [4, 4]]
    assert (found["low"] <= found["value"]).all() and (found["value"] <= found["high"]).all()
    assert found.loc["a", "difference"] == 0 and np.isnan(found.loc["a", "p_value"])


def test_a_small_difference_on_every_heart_is_sure_however_much_the_hearts_differ():
    hearts = np.random.default_rng(5).normal(20, 10, 12)
    found = standing(table(a=hearts, b=hearts + 0.1 + 0.01 * np.arange(12)), statistic="mean")
    assert found.loc["a", "high"] > found.loc["b", "low"]
    assert found.loc["b", "difference"] == pytest.approx(0.155) and found.loc["b", "difference_low"] > 0.1
    assert list(found["rank_first"]) == [1, 2] == list(found["rank_last"])


@pytest.mark.parametrize(("hearts", "last"), [(5, [1, 2]), (4, [2, 2]), (2, [2, 2])])
def test_nobody_is_surely_first_by_fewer_than_five_hearts(hearts, last):
    better = np.arange(1.0, 1 + hearts)
    assert list(standing(table(a=better, b=better + 10))["rank_last"]) == last


def test_where_more_is_better_the_largest_is_first_and_intervals_stay_in_order():
    found = standing(table(a=[1, 2, 3, 4, 2.5], b=[11, 12, 14, 13, 12.5]), descending=True)
    assert list(found.index) == ["b", "a"] and list(found["value"]) == [12.5, 2.5]
    assert (found["low"] <= found["value"]).all() and (found["value"] <= found["high"]).all()
    assert (
        found.loc["a", "difference"] == -10
        and found.loc["a", "difference_low"] <= -10 <= found.loc["a", "difference_high"]
    )
    assert list(found["rank_last"]) == [1, 2]


def test_signed_rank_test_of_six_hearts_that_all_agree_is_two_of_64_and_holm_adjusts_it():
    hearts = np.arange(6.0)
    found = standing(table(a=hearts, b=hearts + [1, 2, 3, 4, 5, 6], c=hearts + [2, 4, 6, 8, 10, 12]))
    np.testing.assert_allclose(found["p_value"], [np.nan, 2 / 32, 2 / 32])
    pairs = paired(table(a=hearts, b=hearts + [1, 2, 3, 4, 5, 6], c=hearts))
    np.testing.assert_allclose(pairs["p_value"], [3 / 32, 1, 3 / 32])
    assert list(zip(pairs["first"], pairs["second"], strict=True)) == [("a", "b"), ("a", "c"), ("b", "c")]
    assert list(pairs["difference"]) == [-3.5, 0, 3.5] and pairs.loc[0, "high"] < 0 < pairs.loc[2, "low"]


def test_one_heart_has_an_order_and_nothing_that_is_sure():
    found = standing(table(a=[5], b=[4]))
    assert list(found.index) == ["b", "a"] and list(found["value"]) == [4, 5]
    assert found[["low", "high", "difference_low", "difference_high", "p_value"]].isna().all(axis=None)
    assert found[["rank_first", "rank_last"]].to_numpy().tolist() == [[1, 2], [1, 2]]


def test_a_tracker_with_a_heart_that_it_does_not_know_is_last_and_has_no_rank():
    found = standing(table(b=[1, np.nan, 1], a=[5, 6, 7]))
    assert list(found.index) == ["a", "b"]
    assert found.loc["b", ["value", "low", "rank_first", "rank_last", "difference"]].isna().all()
    assert list(found.loc["a", ["rank_first", "rank_last"]]) == [1, 1]


def test_no_heart_has_no_value():
    found = standing(table(a=[], b=[]))
    assert list(found["hearts"]) == [0, 0] and found["value"].isna().all()


def clips(values, **others):
    """Rows of clips: (heart, case, view, tracker) to a value."""
    keys = pd.DataFrame(list(values), columns=["heart", "case", "view", "tracker"])
    return keys.assign(size_px=64, failure="", gls=list(values.values()), **others)


def test_clips_of_one_heart_count_as_one():
    rows = {("h1", "c1", "mid", "a"): 1.0, ("h1", "c2", "mid", "a"): 3.0, ("h2", "c3", "mid", "a"): 7.0}
    assert by_heart(clips(rows), "gls")["a"].tolist() == [2, 7]


def test_clips_of_two_repositories_may_have_one_name():
    rows = clips({("h", "c", "mid", "a"): 1.0})
    both = pd.concat([rows.assign(repository="one"), rows.assign(repository="two", gls=3.0)])
    assert by_heart(both, "gls")["a"].tolist() == [2]


def test_views_that_do_not_show_a_metric_do_not_count():
    rows = {("h", "c", view, name): value for name in "ab" for view, value in (("mid", np.nan), ("long", 4.0))}
    assert by_heart(clips(rows), "gls").loc["h"].tolist() == [4, 4]
    mid_only = clips(rows)[lambda found: found["view"] == "mid"]
    assert by_heart(mid_only, "gls").empty


def test_a_tracker_that_lacks_a_clip_has_no_value_of_its_heart():
    rows = {("h", "c", view, name): 1.0 for name in "abc" for view in ("mid", "long")} | {
        ("h", "c", "mid", "b"): np.nan
    }
    del rows["h", "c", "long", "c"]
    found = by_heart(clips(rows), "gls").loc["h"]
    assert found["a"] == 1 and np.isnan(found["b"]) and np.isnan(found["c"])


def test_a_clip_on_which_a_tracker_failed_counts_with_the_value_it_has_there():
    rows = clips({("h", "c", view, name): 10.0 for name in "ab" for view in ("mid", "long")})
    failed = (rows["tracker"] == "b") & (rows["view"] == "mid")
    rows.loc[failed, ["gls", "failure"]] = 100.0, "no motion"
    assert by_heart(rows, "gls").loc["h"].tolist() == [10, 55]
    assert np.isnan(by_heart(rows.assign(gls=rows["gls"].mask(failed)), "gls").loc["h", "b"])

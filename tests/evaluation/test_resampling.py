"""Intervals of means over hearts, and the values of hearts."""

import numpy as np
import pandas as pd

from benchmarks.suite.comparison import by_heart
from echotruth.evaluation.resampling import draws, interval, ranks


def test_interval_of_two_hearts_is_the_whole_range():
    # Each heart is drawn twice in a quarter of the draws: more than 2.5 %.
    low, high = interval(np.array([[1.0], [3.0]]), draws(2, 0))
    assert low == 1 and high == 3


def test_interval_of_many_hearts_is_that_of_normal_theory():
    values = np.random.default_rng(1).normal(5, 2, (400, 1))
    low, high = interval(values, draws(400, 1))
    expected = values.mean() + 1.96 * values.std() / 20 * np.array([-1, 1])
    np.testing.assert_allclose([low[0], high[0]], expected, atol=0.02)


def test_interval_of_24_normal_hearts_holds_the_truth_in_some_95_of_100_samples():
    values = np.random.default_rng(7).normal(3, 2, (24, 400))
    low, high = interval(values, draws(24, 1))
    # Of 400 samples, the share itself varies by 0.011.
    assert 0.90 <= np.mean((low <= 3) & (high >= 3)) <= 0.985


def test_equal_trackers_share_a_rank():
    np.testing.assert_array_equal(ranks(np.array([3.0, 1.0, 1.0, 2.0, np.nan])), [4, 1, 1, 3, np.nan])


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

"""Subtle infarcts found in the strain of segments, and what trackers leave of its differences."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import mannwhitneyu, norm

from benchmarks.suite.detection import comparisons, detection, recovery, subtle


def segments(hearts=6, apart=15.0, spoilt=0.0, seed=0):
    """Rows of hearts, of which every other has an infarct: of a third of segment 7, and of all of segment 8."""
    random, rows = np.random.default_rng(seed), []
    for heart in range(hearts):
        for aha in range(7, 13):
            share = {7: 1 / 3, 8: 1.0}.get(aha, 0.0) if heart % 2 == 0 else 0.0
            true = random.normal(-18 + apart * min(1, 3 * share) + aha, 1)
            clip = {"case": f"c{heart}", "heart": f"h{heart}", "view": "mid", "size_px": 64, "tracker": "a"}
            about = {"group": "healthy" if heart % 2 else "infarct", "aha": aha, "component": "circumferential"}
            strain = {"true_peak_percent": true, "tracked_peak_percent": true + spoilt * random.normal()}
            rows.append(clip | about | {"points": 100, "infarct_share": share} | strain)
    return pd.DataFrame(rows)


def scored(score, positive):
    return pd.DataFrame({"score": score, "positive": positive})


def test_comparisons_are_those_of_the_mann_whitney_statistic_with_ties():
    random = np.random.default_rng(1)
    score, positive = random.integers(0, 6, 60).astype(float), random.random(60) < 0.4
    expected = mannwhitneyu(score[positive], score[~positive]).statistic
    assert comparisons(scored(score, positive)).tolist() == [expected, positive.sum() * (~positive).sum()]


def test_a_tracker_that_says_nothing_finds_infarcts_by_chance():
    assert comparisons(scored(np.full(4, np.nan), [True, False, True, False])).tolist() == [2, 4]
    assert comparisons(scored([1.0, 0.0, np.nan, np.nan], [True, False, True, False])).tolist() == [1 + 3 * 0.5, 4]


def test_partly_scarred_segments_are_compared_with_those_of_the_same_heart_that_have_no_scar():
    rows = segments(4)
    rows.loc[(rows["heart"] == "h0") & (rows["aha"] == 12), "points"] = 10  # a corner
    found = subtle(rows)
    assert found[found["positive"]][["heart", "aha"]].to_numpy().tolist() == [["h0", 7], ["h2", 7]]
    assert found[~found["positive"]].groupby("heart").size().to_dict() == {"h0": 3, "h2": 4}


@pytest.mark.parametrize(("apart", "spoilt"), [(15.0, 15.0), (1.5, 0.0)])
def test_area_is_that_of_two_normal_distributions_of_which_one_is_moved(apart, spoilt):
    found = detection(segments(200, apart, spoilt))
    for name, noise in (("a", spoilt), ("true strain", 0.0)):
        assert found.loc[name, "auc"] == pytest.approx(norm.cdf(apart / np.sqrt(2 + 2 * noise**2)), abs=0.06)
        assert found.loc[name, "low"] <= found.loc[name, "auc"] <= found.loc[name, "high"]
    assert found[["positive", "healthy"]].to_numpy().tolist() == [[100, 400]] * 2


def test_interval_over_hearts_is_that_of_areas_of_samples_of_hearts_taken_one_by_one():
    rows = segments(12, 4.0, 3.0, seed=3)
    column = "tracked_peak_percent"
    normal = rows[rows["group"] == "healthy"].groupby("aha")[column].mean()
    rows["score"] = rows[column] - rows["aha"].map(normal)
    ill, areas = rows[rows["group"] == "infarct"], []
    for sample in np.random.default_rng(1).integers(6, size=(2000, 6)):
        won = []
        for heart in sample:
            of = ill[ill["heart"] == f"h{2 * heart}"].set_index("aha")["score"]
            won += [of[7] > of[free] for free in range(9, 13)]
        areas.append(np.mean(won))
    low, high = np.quantile(areas, [0.025, 0.975], method="inverted_cdf")
    found = detection(rows.drop(columns="score")).loc["a"]
    assert found["low"] == pytest.approx(low) and found["high"] == pytest.approx(high)


def test_hearts_without_an_infarct_have_no_area():
    found = detection(segments(4).assign(group="healthy", infarct_share=0.0))
    assert found[["auc", "low", "high"]].isna().all(axis=None) and list(found["healthy"]) == [0, 0]


def test_what_is_left_of_differences_is_one_of_the_truth_and_what_smoothing_leaves():
    rows = segments(8, seed=5)
    mean = rows.groupby("heart")["true_peak_percent"].transform("mean")
    smooth = rows.assign(tracker="smooth", tracked_peak_percent=0.4 * rows["true_peak_percent"] + 0.6 * mean)
    found = recovery(pd.concat([rows, smooth]))
    np.testing.assert_allclose(found.loc["a"], [1, 1, 4])
    np.testing.assert_allclose(found.loc["smooth"], [0.4, 0.4, 4])

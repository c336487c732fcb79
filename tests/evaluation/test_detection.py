"""Subtle infarcts found in the strain of segments, and what trackers leave of its differences."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import mannwhitneyu, norm

from benchmarks.suite.detection import auc, detection, recovery, subtle


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


def test_area_is_that_of_the_mann_whitney_statistic_with_ties():
    random = np.random.default_rng(1)
    score, positive = random.integers(0, 6, 60).astype(float), random.random(60) < 0.4
    expected = mannwhitneyu(score[positive], score[~positive]).statistic / (positive.sum() * (~positive).sum())
    assert auc(score, positive, np.zeros(60)) == pytest.approx(expected)


def test_area_agrees_with_its_definition_written_out_pair_by_pair_within_strata():
    random = np.random.default_rng(2)
    score, positive, stratum = random.normal(0, 1, 40), random.random(40) < 0.5, random.integers(0, 3, 40)
    won = compared = 0
    for i in range(40):
        for j in range(40):
            if positive[i] and not positive[j] and stratum[i] == stratum[j]:
                won, compared = won + (score[i] > score[j]), compared + 1
    assert auc(score, positive, stratum) == pytest.approx(won / compared)


def test_a_tracker_that_says_nothing_finds_infarcts_by_chance():
    same = np.zeros(4)
    assert auc(np.full(4, np.nan), [True, False, True, False], same) == 0.5
    assert auc([1.0, 0.0, np.nan, np.nan], [True, False, True, False], same) == pytest.approx((1 + 3 * 0.5) / 4)
    assert np.isnan(auc([1.0, 2.0], [True, True], same[:2]))


def test_partly_scarred_segments_are_compared_with_the_same_ones_of_healthy_hearts():
    rows = segments(4)
    rows.loc[(rows["heart"] == "h1") & (rows["aha"] == 7), "points"] = 10  # a corner
    found = subtle(rows)
    assert found[found["positive"]][["heart", "aha"]].to_numpy().tolist() == [["h0", 7], ["h2", 7]]
    assert set(found[~found["positive"]]["heart"]) == {"h1", "h3"} and len(found) == 2 + 11


@pytest.mark.parametrize(("apart", "spoilt"), [(15.0, 15.0), (1.5, 0.0)])
def test_area_is_that_of_two_normal_distributions_of_which_one_is_moved(apart, spoilt):
    found = detection(segments(200, apart, spoilt))
    for name, noise in (("a", spoilt), ("true strain", 0.0)):
        assert found.loc[name, "auc"] == pytest.approx(norm.cdf(apart / np.sqrt(2 + 2 * noise**2)), abs=0.06)
        assert found.loc[name, "low"] <= found.loc[name, "auc"] <= found.loc[name, "high"]
    assert found[["positive", "healthy"]].to_numpy().tolist() == [[100, 600]] * 2


def test_interval_over_hearts_is_that_of_areas_of_samples_of_hearts_taken_one_by_one():
    rows = segments(6, 4.0, 3.0, seed=3)
    of = rows[rows["aha"] == 7].set_index("heart")
    areas = []
    for sample in np.random.default_rng(1).integers(6, size=(2000, 6)):
        drawn = of.loc[[f"h{k}" for k in sample]]
        high, low = (
            drawn.loc[drawn["group"] == name, "tracked_peak_percent"].to_numpy() for name in ("infarct", "healthy")
        )
        if len(high) and len(low):
            areas.append(np.mean(high[:, None] > low))
    low, high = np.quantile(areas, [0.025, 0.975], method="inverted_cdf")
    found = detection(rows).loc["a"]
    assert found["low"] == pytest.approx(low) and found["high"] == pytest.approx(high)


def test_hearts_without_an_infarct_have_no_area():
    found = detection(segments(4).assign(group="healthy", infarct_share=0.0))
    assert found[["auc", "low", "high"]].isna().all(axis=None) and list(found["healthy"]) == [24, 24]


def test_what_is_left_of_differences_is_one_of_the_truth_and_what_smoothing_leaves():
    rows = segments(8, seed=5)
    mean = rows.groupby("heart")["true_peak_percent"].transform("mean")
    smooth = rows.assign(tracker="smooth", tracked_peak_percent=0.4 * rows["true_peak_percent"] + 0.6 * mean)
    found = recovery(pd.concat([rows, smooth]))
    np.testing.assert_allclose(found.loc["a"], [1, 1, 4])
    np.testing.assert_allclose(found.loc["smooth"], [0.4, 0.4, 4])

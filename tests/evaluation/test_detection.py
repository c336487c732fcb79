"""Infarcts found in the strain of segments."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import mannwhitneyu

from benchmarks.suite.detection import auc, detection, infarcted


def segments(hearts=6, spoilt=0.0, seed=0):
    """Rows of hearts, of which every other has an infarct in segments 7 and 8, the latter subendocardial."""
    random, rows = np.random.default_rng(seed), []
    for heart in range(hearts):
        for aha in range(7, 13):
            scar = heart % 2 == 0 and aha in (7, 8)
            true = random.normal(-3 if scar else -18, 1)
            rows.append(
                {
                    **{
                        "case": f"c{heart}",
                        "heart": f"h{heart}",
                        "view": "mid",
                        "size_px": 64,
                        "tracker": "a",
                        "aha": aha,
                    },
                    **{"component": "circumferential", "points": 100, "infarct_share": 0.6 * scar},
                    **{"infarct_extent": 1.0 * scar, "epicardial_share": float(scar and aha == 7)},
                    **{"true_peak_percent": true, "tracked_peak_percent": true + spoilt * random.normal()},
                }
            )
    return pd.DataFrame(rows)


def test_area_is_that_of_the_mann_whitney_statistic_with_ties():
    random = np.random.default_rng(1)
    score, positive = random.integers(0, 6, 60).astype(float), random.random(60) < 0.4
    expected = mannwhitneyu(score[positive], score[~positive]).statistic / (positive.sum() * (~positive).sum())
    assert auc(score, positive) == pytest.approx(expected)


def test_area_agrees_with_its_definition_written_out_pair_by_pair_within_strata():
    random = np.random.default_rng(2)
    score, positive, stratum = random.normal(0, 1, 40), random.random(40) < 0.5, random.integers(0, 3, 40)
    won = pairs = 0
    for i in range(40):
        for j in range(40):
            if positive[i] and not positive[j] and stratum[i] == stratum[j]:
                won, pairs = won + (score[i] > score[j]), pairs + 1
    assert auc(score, positive, stratum) == pytest.approx(won / pairs)


def test_a_tracker_that_says_nothing_finds_infarcts_by_chance():
    assert auc(np.full(4, np.nan), [True, False, True, False]) == 0.5
    assert auc([1.0, 0.0, np.nan, np.nan], [True, False, True, False]) == pytest.approx((1 + 3 * 0.5) / 4)
    assert np.isnan(auc([1.0, 2.0], [True, True]))


def test_segments_that_are_apart_are_all_found_and_noise_of_their_distance_hides_some():
    clear, hidden = (detection(segments(20, spoilt)).set_index("component").loc["all"] for spoilt in (0.0, 15.0))
    assert clear["auc"] == clear["true_auc"] == hidden["true_auc"] == 1 and clear["auc_low"] == 1
    # The difference of two values has 15 of mean and a standard deviation of 15 sqrt(2): Phi(0.71) = 0.76.
    assert hidden["auc"] == pytest.approx(0.76, abs=0.08)
    assert hidden["auc_low"] < hidden["auc"] < hidden["auc_high"]
    assert list(clear[["infarcted", "free", "hearts", "subendocardial"]]) == [20, 100, 20, 10]


def test_interval_over_hearts_is_that_of_areas_of_samples_of_hearts_taken_one_by_one():
    rows = segments(5, 12.0, seed=3)
    found = detection(rows, seed=4).set_index("component").loc["all"]
    scars, free = (
        [rows.loc[(rows["heart"] == f"h{k}") & kind, "tracked_peak_percent"].to_numpy() for k in range(5)]
        for kind in (rows["infarct_share"] > 0, rows["infarct_share"] == 0)
    )
    areas = []
    for sample in np.random.default_rng(4).integers(5, size=(2000, 5)):
        high, low = (np.concatenate([of_heart[k] for k in sample]) for of_heart in (scars, free))
        if len(high):
            areas.append(np.mean(high[:, None] > low))
    low, high = np.quantile(areas, [0.025, 0.975], method="inverted_cdf")
    assert found["auc_low"] == pytest.approx(low) and found["auc_high"] == pytest.approx(high)


def test_subendocardial_infarcts_are_counted_apart():
    rows = segments(8)
    shallow = (rows["infarct_share"] > 0) & (rows["epicardial_share"] == 0)
    rows.loc[shallow, "tracked_peak_percent"] = -30.0
    found = detection(rows).set_index("component").loc["circumferential"]
    assert found["auc"] == 0.5 and found["subendocardial_auc"] == 0 and found["true_subendocardial_auc"] == 1


def test_both_components_are_compared_each_with_itself():
    short, long = segments(4), segments(4).assign(component="longitudinal", view="long")
    long[["true_peak_percent", "tracked_peak_percent"]] += 30.0
    found = detection(pd.concat([short, long])).set_index("component")["auc"]
    assert found.to_dict() == {"circumferential": 1, "longitudinal": 1, "all": 1}


def test_partly_infarcted_segments_and_corners_of_segments_are_left_out():
    rows = segments(2)
    rows.loc[rows.index[-1], ["infarct_share", "infarct_extent"]] = 0.1, 0.4
    rows.loc[rows.index[-2], "points"] = 10
    assert np.isnan(infarcted(rows).iloc[-1]) and infarcted(rows).sum() == 2
    assert detection(rows).set_index("component").loc["all", "free"] == 8


def test_hearts_without_an_infarct_have_no_area():
    found = detection(segments(4)[lambda rows: rows["infarct_share"] == 0]).set_index("component").loc["all"]
    assert found[["auc", "auc_low", "true_auc", "subendocardial_auc"]].isna().all() and found["free"] == 20
    assert detection(segments(4).iloc[:0]).empty

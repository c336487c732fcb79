"""The order of trackers, and how sure it is."""

import numpy as np
import pandas as pd
import pytest
from board import Board

from echotruth.config import Bmode, Config, PhaseCorrelation, Tracking, View
from echotruth.evaluation.leaderboard import best, rows, standings


def scores(values, views=("mid",), failure=""):
    """Rows of trackers: name to one NRMSE (%) a heart, the same in all views."""
    lines = [
        {"case": f"heart{k}", "view": view, "size_px": 64, "tracker": name, "nrmse_all_percent": value}
        for name, each in values.items()
        for k, value in enumerate(each)
        for view in views
    ]
    strains = {f"{name}_rms_pp": 1.0 for name in ("e_cc", "e_ll", "e_rr")}
    return pd.DataFrame(lines).assign(**strains, failure=failure)


def overall(table):
    return table[table["view"] == "all"].set_index("tracker")


def test_equal_trackers_share_a_rank():
    table = overall(standings(scores({"a": [5, 7, 9], "b": [5, 7, 9], "c": [6, 8, 10]}), 1))
    assert list(table["rank"]) == [1, 1, 3]
    assert (table.loc["a"].drop("hearts") == table.loc["b"].drop("hearts"))[["rank_low", "rank_high"]].all()


def test_a_tracker_better_on_every_heart_is_first_for_sure_and_one_that_swaps_is_not():
    table = overall(standings(scores({"b": [4, 9, 4, 9, 5, 6], "a": [1, 2, 1, 2, 1, 1], "c": [9, 4, 9, 4, 6, 6]}), 1))
    assert list(table.index) == ["a", "b", "c"]
    assert list(table.loc["a", ["rank_low", "rank_high"]]) == [1, 1]
    assert list(table.loc["b", ["rank_low", "rank_high"]]) == [2, 3]


@pytest.mark.parametrize("hearts", [1, 5])
def test_few_hearts_have_an_order_and_any_rank_is_possible(hearts):
    table = overall(standings(scores({"a": [50] * hearts, "b": [4] * hearts}), 1))
    assert list(table.index) == ["b", "a"] and list(table["rank"]) == [1, 2]
    assert table[["rank_low", "rank_high"]].to_numpy().tolist() == [[1, 2], [1, 2]]
    bounds = [name for name in table if name.endswith(("_low", "_high")) and not name.startswith("rank")]
    assert (table[bounds].isna().to_numpy() == (hearts == 1)).all()


def test_a_tracker_not_tried_on_every_clip_has_no_rank():
    whole = scores({"a": [5, 5], "b": [1, 1]}, views=("mid", "apex"))
    table = standings(whole[~((whole["tracker"] == "b") & (whole["view"] == "apex") & (whole["case"] == "heart1"))], 1)
    assert overall(table).loc["a", "rank"] == 1 and np.isnan(overall(table).loc["b", "rank"])
    assert list(overall(table)["hearts"]) == [2, 1] and best(table) == ["a", "b"]
    mid = table[table["view"] == "mid"].set_index("tracker")
    assert mid.loc["b", "rank"] == 1


@pytest.mark.parametrize("failure", ["b: no motion found", ""])
def test_losing_the_hard_clip_does_not_pay(failure):
    """Of two equal trackers, one has no answer on the clip with the largest errors, and says so or not."""
    whole = scores({"a": [5, 5], "b": [5, 5]}, views=("mid", "apex"))
    hard = (whole["case"] == "heart1") & (whole["view"] == "apex")
    whole = whole.assign(epe_um=np.where(hard, 40.0, 10.0), coverage_percent=100.0)
    lost = hard & (whole["tracker"] == "b")
    figures = ["epe_um", "e_cc_rms_pp", "e_ll_rms_pp", "e_rr_rms_pp"]
    whole.loc[lost, figures] = np.nan
    whole.loc[lost, ["nrmse_all_percent", "coverage_percent", "failure"]] = 100.0, 0.0, failure
    table = standings(whole, 1)
    means = overall(table)
    assert list(means["rank"]) == [1, 2]
    np.testing.assert_allclose(means["nrmse_all_percent"], [5, (5**3 * 100) ** 0.25])
    assert means.loc["a", "epe_um"] == 17.5 and means.loc["b", "coverage_percent"] == 75
    bounds = [f"{name}_{end}" for name in figures[1:] for end in ("low", "high")]
    assert means.loc["a", [*figures, *bounds]].notna().all() and means.loc["b", [*figures, *bounds]].isna().all()
    assert means["nrmse_all_percent_high"].notna().all() and means.loc["b", "failures"] == bool(failure)
    mid, apex = (table[table["view"] == view].set_index("tracker") for view in ("mid", "apex"))
    assert list(mid["epe_um"]) == [10, 10] and apex["epe_um"].isna().tolist() == [False, True]


def test_views_that_show_a_strain_to_no_tracker_do_not_count_in_its_mean():
    whole = scores({"a": [5, 6], "b": [7, 8]}, views=("mid", "long_axis"))
    whole.loc[whole["view"] == "mid", "e_ll_rms_pp"] = np.nan
    table = standings(whole, 1)
    assert (overall(table)[["e_ll_rms_pp", "e_ll_rms_pp_low", "e_ll_rms_pp_high"]] == 1).all(axis=None)
    assert table[table["view"] == "mid"]["e_ll_rms_pp"].isna().all()


def test_a_mean_over_views_is_one_of_hearts():
    table = scores({"a": [4, 8]}, views=("mid", "apex"))
    table.loc[table["view"] == "apex", "nrmse_all_percent"] *= 3
    found = standings(table, 1)
    np.testing.assert_allclose(found["nrmse_all_percent"], np.sqrt(32) * np.array([np.sqrt(3), 1, 3]))
    assert list(found["view"]) == ["all", "mid", "apex"]


def test_cases_of_one_heart_are_drawn_together_with_their_mean():
    """As if there were one case a heart with the mean of its cases; without hearts, each case is one."""
    hearts = {"heart0": "a", "heart1": "b", "heart2": "a", "heart3": "c"}
    of_cases = scores({"one": [4, 7, 9, 3], "two": [5, 2, 20, 8]}, views=("mid", "apex"))
    of_hearts = scores({"one": [6, 7, 3], "two": [10, 2, 8]}, views=("mid", "apex"))
    found = standings(of_cases, 1, hearts)
    pd.testing.assert_frame_equal(found, standings(of_hearts, 1))
    assert set(found["hearts"]) == {3} and set(standings(of_cases, 1)["hearts"]) == {4}
    pd.testing.assert_frame_equal(standings(of_cases, 1), standings(of_cases, 1, {case: case for case in hearts}))


def test_a_tracker_not_tried_on_a_case_of_a_heart_does_not_have_the_heart():
    whole = scores({"a": [5, 5, 5], "b": [1, 1, 1]})
    table = standings(whole.drop(index=whole.index[-1]), 1, {"heart0": "x", "heart1": "y", "heart2": "y"})
    assert list(overall(table)["hearts"]) == [2, 1] and np.isnan(overall(table).loc["b", "rank"])


def test_the_seed_decides_the_draws():
    table = scores({"a": np.random.default_rng(0).normal(9, 1, 7), "b": np.random.default_rng(1).normal(9, 1, 7)})
    pd.testing.assert_frame_equal(standings(table, 3), standings(table, 3))
    assert not standings(table, 3).equals(standings(table, 4))


CONFIG = Config(
    views={"mid": View(), "long_axis": View(plane="long_axis")},
    bmode=Bmode(size_px=64, downsampling=(1,)),
    tracking=Tracking(trackers={name: PhaseCorrelation(window_px=16) for name in ("one", "two")}),
)


def board(folder, hearts="abc", about=None):
    """Hearts of which everything is 0.1 or, of the second tracker, 0.2."""
    return Board(CONFIG, folder, {case: dict.fromkeys(CONFIG.views, (0.1, 0.2)) for case in hearts}, about)


def test_rows_are_of_the_hearts_that_count(tmp_path):
    table = rows(board(tmp_path, "ac"))
    assert list(table["case"]) == ["a"] * 4 + ["c"] * 4 and list(table["tracker"]) == ["one", "two"] * 4
    assert list(table["nrmse_percent"][:2]) == [10, 20] and (table["failure"] == "").all()
    assert table["e_cc_rms_pp"].isna().tolist() == [False, False, True, True] * 2


def test_a_repository_whose_hearts_are_not_finished_has_no_rows(tmp_path):
    table = rows(board(tmp_path, ""))
    assert table.empty and list(table.columns) == ["case", "view", "size_px", "tracker", "failure", "no_estimate"]


def test_a_failure_is_told_beside_the_scores(tmp_path):
    about = {("tracking/two", "b", "mid"): {"failures": {"64": "no motion found"}}}
    table = rows(board(tmp_path, about=about))
    assert list(table[table["failure"] != ""][["case", "view", "tracker"]].iloc[0]) == ["b", "mid", "two"]
    assert overall(standings(table, 1)).loc["two", "failures"] == 1


def test_tracker_that_was_run_on_some_clips_alone_has_no_rows_of_the_others_and_no_rank(tmp_path):
    about = {("tracking/two", case, "mid"): {"status": "unfinished"} for case in "ab"}
    table = rows(board(tmp_path, about=about))
    of_two = table[table["tracker"] == "two"]
    assert list(of_two[["case", "view"]].itertuples(index=False, name=None)) == [
        ("a", "long_axis"), ("b", "long_axis"), ("c", "mid"), ("c", "long_axis")
    ]  # fmt: skip
    assert best(standings(table, 1)) == ["one", "two"] and np.isnan(overall(standings(table, 1)).loc["two", "rank"])

"""The page of the suite: what it says of hearts of which the errors are drawn."""

import re

import numpy as np
import pandas as pd
import pytest
from synthetic_parts import DEVIATION, EFFECTS, parts

from benchmarks.suite import page, power
from benchmarks.suite.comparison import against, deviation, ranking, scores
from benchmarks.suite.power import simulate


@pytest.fixture(scope="module")
def made():
    return parts()


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    monkeypatch.setattr(power, "SAMPLES", 60)


def mice(made):
    return made[(made["species"] == "mouse") & (made["split"] == "test") & (made["size_px"] == 256)]


def test_scores_are_geometric_means_over_clips_and_hearts(made):
    of = mice(made).assign(failure="")
    found = ranking(scores(of))
    own = np.log(of[of["tracker"] == "dis"].groupby("heart")["nrmse_all_percent"].prod())
    clips = of[of["tracker"] == "dis"].groupby("heart").size()
    assert np.log(found.loc["dis", "score"]) == pytest.approx((own / clips).mean())


def test_order_and_ratios_are_those_that_were_drawn(made):
    of = scores(mice(made).assign(failure=""))
    found = ranking(of)
    assert list(found["rank_first"]) == [1, 1, 3, 4, 4, 6, 7] and list(found["rank_last"]) == [2, 2, 3, 5, 5, 6, 7]
    drawn = np.exp([EFFECTS[name] - EFFECTS[found.index[0]] for name in found.index])
    # Three standard errors of a ratio; `corrected` fails here and there, which costs it more.
    error = 3 * np.hypot(DEVIATION, 0.1) / np.sqrt(48)
    assert np.allclose(np.log(found["ratio"] / drawn).drop("corrected"), 0, atol=error)
    beside, others = against(of, found.index[0]), found.iloc[1:]
    assert list(beside.index) == list(others.index) and np.allclose(beside["ratio"], others["ratio"])
    assert ((others["low"] < beside["low"]) & (beside["high"] < others["high"])).all()
    # Both views have noise of 0.1 of their own; failures of one tracker do not move the median over pairs.
    assert deviation(of) == pytest.approx(np.hypot(DEVIATION, 0.1), rel=0.15)


def test_tracker_without_a_heart_has_no_rank_and_the_others_keep_theirs(made):
    of = mice(made).assign(failure="")
    whole = ranking(scores(of))
    found = ranking(scores(of[(of["tracker"] != "as_published") | (of["heart"] != of["heart"].iloc[0])]))
    assert found.index[-1] == "as_published" and found.loc["as_published"].isna().all()
    pd.testing.assert_series_equal(found["score"][:-1], whole["score"][:-1])
    assert list(found["rank_last"][:-1]) == [2, 2, 3, 5, 5, 6]


def test_power_is_that_of_the_t_of_textbooks_with_the_critical_value_of_its_largest(monkeypatch):
    monkeypatch.setattr(power, "SAMPLES", 400)
    found = simulate(np.zeros(48), 0.22, True)
    boards = np.random.default_rng(4).normal(0, 0.22 / np.sqrt(2), (4000, 48, 10))
    differences = boards[..., :1] - boards[..., 1:]
    error = differences.std(axis=1, ddof=1) / np.sqrt(48)
    t = differences.mean(axis=1) / error
    critical = np.quantile(np.abs(t).max(axis=1), 0.95)
    for less in (0.05, 0.1, 0.15):
        # Of 400 boards, of which the comparisons depend on each other, the share varies by 0.015.
        assert found.of(less) == pytest.approx(np.mean(t - np.log1p(-less) / error > critical), abs=0.045)
    assert found.false_order <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 400)
    assert found.of(found.least) == pytest.approx(power.FOUND, abs=0.01)
    assert simulate(np.zeros(12), 0.22, True).of(0.35) > 0.9 and simulate(np.zeros(48), 0.22, False).of(0.1) < found.of(
        0.1
    )


def text_of(made, tmp_path, split="test"):
    return page.write(made, tmp_path / "page.md", split).read_text()


def test_page_has_the_same_bytes_again_and_its_numbers_are_those_of_the_parts(made, tmp_path):
    first = text_of(made, tmp_path)
    files = {file.name: file.read_bytes() for file in (tmp_path / "page").iterdir()}
    assert set(files) == {"ratios.png", "power.png", "reliability.png"} == set(re.findall(r"\(page/(.*)\)", first))
    assert text_of(made, tmp_path) == first
    assert files == {file.name: file.read_bytes() for file in (tmp_path / "page").iterdir()}
    board = ranking(scores(mice(made)[lambda of: of["acoustics"] == "realistic"].assign(failure="")))
    for name, row in board.iterrows():
        assert f"| `{name}` | {page.ranks(row)} | {row['score']:.1f} | {page.interval(row, 2)} |" in first
    assert "| group | human | mouse |" in first and "| infarct | 5 | 20 |" in first and "of 96 |" in first
    assert "nan" not in first and "inf)" not in first


def test_half_is_the_one_that_is_asked_for(made, tmp_path):
    text = text_of(made, tmp_path, "develop")
    assert "python -m benchmarks.suite page --split develop" in text and "12 mice, each with each" in text
    changed = made.assign(nrmse_all_percent=np.where(made["split"] == "test", 1.0, made["nrmse_all_percent"]))
    assert text_of(changed, tmp_path, "develop") == text


def test_page_of_few_hearts_says_that_they_order_nobody(tmp_path):
    text = text_of(parts(hearts={("test", "mouse"): 5, ("test", "human"): 3}), tmp_path)
    assert "Of the 6 hearts that it takes to order trackers, 5 are there" in text
    assert "Of the 6 hearts that it takes to tell trackers apart, 3 are there" in text
    assert text.count("| 1–7 |") >= 7 and " worse" not in text and "power.png" not in text


def test_page_without_a_heart_of_the_half_has_no_results(tmp_path):
    assert "has no results" in text_of(parts(hearts={("develop", "mouse"): 2}), tmp_path)


def test_cost_is_read_from_the_files_beside_the_parts(made, tmp_path):
    first = made.iloc[:2][["case", "view", "size_px", "tracker"]]
    for part, cost in enumerate((0.2, 0.4)):
        first.iloc[part : part + 1].assign(cpu_s=cost).to_csv(tmp_path / f"cost-0{part}.csv", index=False)
    found = page.with_cost(made.drop(columns="cpu_s"), tmp_path)
    assert found["cpu_s"].tolist()[:2] == [0.2, 0.4] and found["cpu_s"][2:].isna().all() and len(found) == len(made)


def test_effect_that_a_disease_has_on_all_of_its_hearts_orders_no_equal_trackers(monkeypatch):
    monkeypatch.setattr(power, "SAMPLES", 400)
    diseases = np.repeat(range(5), [12, 16, 7, 6, 7])
    error = np.sqrt(0.06 * 0.94 / 400)
    assert simulate(diseases, 0.2, False, power.DISEASE_EFFECT).false_order <= 0.06 + 2 * error

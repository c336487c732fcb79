"""The page: its conditions, who is ahead, its bytes, and what a person wrote into it."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.suite import tables
from benchmarks.suite.__main__ import main, parser
from benchmarks.suite.conditions import groups, main_conditions, variations, with_conditions
from benchmarks.suite.page import Page
from benchmarks.suite.records import Records
from benchmarks.suite.standings import METRICS, RANKED_BY, agreement, order, standings, varied
from echotruth.evaluation.tracker_options import EvaluationError

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]

HEARTS = 12


def made_clips():
    """Twelve hearts, half of them diseased, by three trackers: b is worse than a on the healthy, c always.

    Two hearts are there once more in an oblique plane, with twice the error.
    """
    rows = []
    for heart in range(HEARTS):
        diseased = heart >= HEARTS // 2
        plain = [("ideal", "none", 1), ("realistic", "none", 2)]
        for acoustics, variation, factor in [*plain, *([("ideal", "oblique", 2)] if heart in (1, 8) else [])]:
            for tracker, error in {"a": 4.0, "b": 4.0 if diseased else 5.0, "c": 9.0}.items():
                noise = (heart * 7 + ord(tracker) * (3 if diseased else 0)) % 5 / 10
                case = {"repository": "made", "species": "mouse", "case": f"h{heart}_{acoustics}_{variation}"}
                labels = {"group": "infarct" if diseased else "healthy", "diagnosis": "", "variation": variation}
                clip = {"heart": f"h{heart}", "acoustics": acoustics, "view": "mid", "size_px": 512, "failure": ""}
                errors = dict.fromkeys(METRICS, np.nan) | {RANKED_BY: factor * (error + noise)}
                rows.append(case | labels | clip | {"tracker": tracker} | errors)
    return with_conditions(pd.DataFrame(rows))


def test_conditions_are_disease_and_acoustics_and_a_variation_is_none_of_them():
    clips = made_clips()
    names = ["healthy, ideal", "healthy, realistic", "diseased, ideal", "diseased, realistic"]
    assert {name: len(part) for name, part in main_conditions(clips).items()} == dict.fromkeys(names, 18)
    assert {name: len(part) for name, part in groups(clips).items()} == {"healthy": 36, "infarct": 36}
    ((oblique, plain),) = variations(clips).values()
    assert list(oblique["case"].unique()) == ["h1_ideal_oblique", "h8_ideal_oblique"]
    assert list(plain["case"].unique()) == ["h1_ideal_none", "h8_ideal_none"]
    table = varied(clips)
    assert np.allclose(table["varied"], 2 * table["plain"]) and list(table["hearts"]) == [2, 2, 2]
    human = with_conditions(clips.assign(species="human"))
    assert list(main_conditions(human)) == ["human, ideal", "human, realistic"] and not groups(human)


def test_median_over_hearts_is_that_of_each_condition():
    clips = made_clips()
    found = standings(clips).set_index(["is_main", "condition", "tracker"])["value"]
    errors = clips[(clips["condition"] == "diseased, realistic") & (clips["tracker"] == "b")][RANKED_BY]
    assert found[True, "diseased, realistic", "b"] == pytest.approx(np.median(errors))
    # Over both acoustics, the mean of a heart comes first.
    plain = clips[clips["variation"] == "none"]
    both = plain[(plain["group"] == "healthy") & (plain["tracker"] == "a")].groupby("heart")[RANKED_BY].mean()
    assert found[False, "healthy", "a"] == pytest.approx(both.median())


def test_ahead_is_who_is_surely_ahead_in_the_condition():
    table = standings(made_clips())
    assert order(table) == ["a", "b", "c"]
    text = tables.ahead(table).replace("\N{NO-BREAK SPACE}", " ")
    lines = {line.split("|")[1].strip(): line for line in text.splitlines()}
    assert lines["healthy, ideal, 512 px"].split("|")[2].strip() == "`a`"
    assert lines["healthy, ideal, 512 px"].rstrip(" |").endswith("nobody")
    near = lines["diseased, ideal, 512 px"].split("|")[-2]
    assert "`c`" not in near and ("`a`" in near or "`b`" in near)
    ranks = table[(table["condition"] == "diseased, ideal") & table["is_main"]].set_index("tracker")
    assert [tables.rank(ranks.loc[name]) for name in "abc"] == ["1–2", "1–2", "3"]


def test_tracker_that_was_evaluated_at_the_smaller_size_only_is_ordered_last():
    clips = made_clips()
    smaller = clips.assign(size_px=256)
    more = smaller[smaller["tracker"] == "a"].assign(tracker="late")
    table = standings(pd.concat([clips, smaller, more], ignore_index=True))
    assert order(table) == ["a", "b", "c", "late"]


def strain_clips(failed):
    """Three hearts in two planes by one tracker, whose GLS is 1 pp too small; it failed on the clips (heart, view)."""
    rows = []
    for heart in range(3):
        for view, name, other in (("mid", "gcs", "gls"), ("long", "gls", "gcs")):
            is_failed, true = (heart, view) in failed, -12.0 - heart
            values = {f"true_{name}_percent": true, f"tracked_{name}_percent": np.nan if is_failed else true + 1}
            values |= {f"{what}_{other}_percent": np.nan for what in ("true", "tracked")}
            clip = {"repository": "made", "case": f"h{heart}", "heart": f"h{heart}", "view": view, "size_px": 512}
            labels = {"variation": "", "acoustics": "ideal", "failure": "lost" if is_failed else "", "tracker": "a"}
            rows.append(clip | labels | values)
    return pd.DataFrame(rows)


@pytest.mark.parametrize(("failed", "hearts"), [([], 3), ([(1, "mid")], 3), ([(1, "long")], 2)])
def test_agreement_of_a_strain_is_over_the_hearts_whose_clips_of_its_plane_were_tracked(failed, hearts):
    found = agreement(strain_clips(failed)).set_index("strain").loc["gls"]
    assert (found["hearts"], found["of_hearts"]) == (hearts, 3) and found["bias"] == pytest.approx(1)
    text = tables.agreement(agreement(strain_clips(failed)), ["a"])
    line = next(line for line in text.splitlines() if "GLS" in line)
    assert (", 2 of 3 hearts" in line) == (hearts == 2)


def beside(known, species, size=64, factor=1.0, name="other", preset="medium"):
    """Records of a repository beside another one, the same but for species, image size, test errors and `dis`."""
    of = {"repository": name, "species": species}
    suite = known.suites[0]
    config = suite.config.model_copy(update={"name": name})
    tracking = {
        **config.tracking.trackers,
        "dis": config.tracking.trackers["dis"].model_copy(update={"preset": preset}),
    }
    config = config.model_copy(update={"tracking": config.tracking.model_copy(update={"trackers": tracking})})
    more = []
    for table in (known.clips, known.segments, known.reliability):
        factors = np.where(table["split"] == "test", factor, 1)
        scaled = {column: table[column] * factors for column in (RANKED_BY, "drift_um") if column in table}
        more.append(with_conditions(table.assign(**of, **scaled, size_px=size, heart=name + table["heart"])))
    difficulty = known.difficulty.assign(repository=name, size_px=size)
    both = zip((known.clips, known.segments, known.reliability, known.difficulty), (*more, difficulty), strict=True)
    other = copy(suite.repository)
    other.store, other.config = suite.repository.store, config
    return Records([suite, replace(suite, repository=other)], *(pd.concat(each, ignore_index=True) for each in both))


def test_drift_quality_and_gap_are_of_the_main_species_and_the_page_says_so(page, tmp_path):
    alone, both = page, Page(beside(page.whole, "human", factor=100), "test")
    for what in (Page.failures, Page.reliability):
        assert what(both) == what(alone)
    assert both.verdict("dis").gap == alone.verdict("dis").gap
    text = both.write(tmp_path / "page.md", "python -m benchmarks.suite").read_text()
    assert "### Human, ideal" in text and "Everything\nelse is of the species mouse alone" in text
    assert "of the species" not in alone.write(tmp_path / "alone.md", "python -m benchmarks.suite").read_text()


def test_rank_is_at_the_largest_size_of_the_main_species(page):
    both = Page(beside(page.whole, "human", size=128), "test")
    assert both.largest == 64 and both.order == page.order and both.sizes == [64]
    text = both.leaderboard()
    assert text.startswith("NRMSE at end-systole, % at 64 px") and "human, ideal (128 px)" in text
    assert "rank" in tables.condition(both.standings, "human, ideal", 64)
    assert "tracker, at 128" in tables.others(both.standings, "human, ideal", both.order, 64)
    with pytest.raises(EvaluationError, match=r"no image size in common: bench \(64 px\), other \(128 px\)"):
        Page(beside(page.whole, "mouse", size=128), "test")


def test_settings_that_differ_are_told_of_each_repository(page):
    assert page._own_settings("dis") == "`dis` of echotruth"
    both = Page(beside(page.whole, "human", preset="fine"), "test")
    assert both._own_settings("dis") == "In `bench`: `dis` of echotruth. In `other`: `dis` of echotruth; preset fine"
    assert page._own_settings("honest") == "no card"


def test_strain_of_a_heart_is_that_of_a_case_that_is_finished(page, monkeypatch):
    monkeypatch.setattr(tables, "heart_of", lambda case: "one")
    strains = {"true_gls_percent": -11.5, "true_gcs_percent": -14.5}
    clips = pd.DataFrame([{"repository": "bench", "case": "b_ideal"} | strains])
    assert "| −11.5 | −14.5 |" in tables.hearts(page.whole.suites[0], clips)


def test_cells_of_a_table_cannot_end_it():
    assert tables.markdown(["a"], [["x | y"]]).splitlines()[-1] == "| x \\| y |"


def run(*arguments):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["suite", *map(str, arguments)])
        return main()


@pytest.mark.slow
def test_command_writes_the_page_twice_alike_and_keeps_what_a_person_wrote(repository, tmp_path, capsys):
    (repository / "bench.zarr/clips/b_ideal/mid/tracking/64/zarr.json").unlink()
    shutil.rmtree(repository / "external")
    page = tmp_path / "page.md"
    arguments = (repository, "--page", page)
    assert run(*arguments) == 0
    assert "`bench` has 2 of 3 clips." in page.read_text()
    page.write_text(page.read_text().replace("- Nothing is noted yet.", "- Noted by hand."))
    first = {file.name: file.read_bytes() for file in [page, *(tmp_path / "page").iterdir()]}
    assert {"leaderboard.csv", "conditions.png", "floors.png", "reliability.png", "example_dis.png"} < set(first)
    assert run(*arguments) == 0
    assert first == {file.name: file.read_bytes() for file in [page, *(tmp_path / "page").iterdir()]}
    assert "- Noted by hand." in page.read_text() and "dis" in capsys.readouterr().out


def test_every_option_is_explained_and_every_command_that_is_printed_is_understood():
    whole, published = parser(), (ROOT / "docs/benchmark.md").read_text()
    assert all(action.help for action in whole._actions)
    printed = re.findall(r"^ *python -m benchmarks\.suite (.*)$", f"{whole.description}\n{published}", re.MULTILINE)
    assert len(printed) == 5 and all(whole.parse_args(shlex.split(words)).repository for words in printed)


NUMBER = re.compile(r"\d+(?:\.\d+)?")


def is_alike(line, other):
    """Whether two lines are the same but for a unit in the last decimal of their numbers."""
    pairs = zip(*(NUMBER.findall(text) for text in (line, other)), strict=False)
    units = ((one, another, 10.0 ** -len(one.partition(".")[2]) if "." in one else 0) for one, another in pairs)
    near = all(abs(float(one) - float(another)) <= 1.001 * unit for one, another, unit in units)
    return near and NUMBER.sub("", line) == NUMBER.sub("", other)


def test_published_page_is_what_its_values_give(page, tmp_path):
    published = (ROOT / "docs/benchmark.md").read_text()
    values = pd.read_csv(ROOT / "docs/benchmark/leaderboard.csv")  # six digits of each
    trackers = order(values, 512)
    found = [tables.ahead(values), tables.by_group(values, trackers)]
    for name in values[values["is_main"]]["condition"].unique():
        found += [tables.condition(values, name, 512), tables.others(values, name, trackers, 512)]
    lines = published.splitlines()
    for table in map(str.splitlines, found):
        starts = range(len(lines) - len(table) + 1)
        assert any(all(map(is_alike, table, lines[start:])) for start in starts), table
    text = page.write(tmp_path / "page.md", "").read_text()
    submit = "## Submit your own"
    assert text.partition(submit)[2] == published.partition(submit)[2] != ""


def test_command_runs_from_the_checkout_in_several_processes(submitted, repository):
    words = [sys.executable, "-m", "benchmarks.suite", repository, "--check", "honest", "--jobs", "2"]
    path = os.pathsep.join(filter(None, [str(submitted.parent), os.environ.get("PYTHONPATH")]))
    environment = os.environ | {"PYTHONPATH": path}
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "honest: nothing found (error on mirrored clips" in done.stdout, done.stderr


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--check", "nobody"], "nobody: the motion that it tracked is not kept in"),
        (["--check", "honest", "--size", "100"], "--size 100: is not an image size of"),
        (["--check", "honest", "--jobs", "0"], "--jobs 0: must be 1 or more"),
        (["--card", "absent.yaml"], "absent.yaml: cannot be read"),
        (["--page", "hearts.csv/page.md"], "hearts.csv: it must be a folder that you may write to"),
        (["--page", "page"], "--page page: must be a Markdown file: give a name that ends in .md"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(submitted, capsys, monkeypatch, arguments, sentence):
    monkeypatch.chdir(submitted.parent)
    assert run(submitted, *arguments) == 2
    errors = capsys.readouterr().err
    assert sentence in errors and "Traceback" not in errors


@pytest.mark.parametrize("arguments", [["bench", "bench"], ["bench", "--page", "hearts.csv/page.md"]])
def test_what_is_wrong_is_told_before_a_tracker_runs_again(submitted, monkeypatch, capsys, arguments):
    monkeypatch.chdir(submitted.parent)
    assert run(*arguments, "--check", "honest") == 2
    output, errors = capsys.readouterr()
    assert output == "" and errors.count("\n") == 1


@pytest.mark.parametrize(
    ("before", "after", "sentence"),
    [
        ("c,develop", "c,Develop", "case c_ideal: label.split = Develop: use develop or test"),
        ("c,develop", "a,develop", "heart a is in both halves (a_ideal: test, c_ideal: develop): give its cases one"),
    ],
)
def test_half_that_is_not_clear_is_refused(repository, capsys, before, after, sentence):
    config = repository / "config.yaml"
    config.write_text(config.read_text().replace(before, after))
    assert run(repository) == 2
    errors = capsys.readouterr().err
    assert f"{repository}: {sentence}" in errors and errors.count("\n") == 1


def test_what_is_not_true_of_the_hearts_is_not_printed(page, repository, tmp_path):
    text = page.write(tmp_path / "page.md", "python -m benchmarks.suite").read_text()
    assert "each half has hearts of each group" not in text and "are in one half" in text  # dilation is in test only
    config = repository / "config.yaml"
    config.write_text(config.read_text().replace("develop", "test"))
    assert run(repository, "--split", "develop", "--page", tmp_path / "page.md") == 0
    text = (tmp_path / "page.md").read_text()
    assert "All hearts are in the half **test**" in text
    assert "No clip of the half develop is evaluated: the repositories have no heart of it." in text


def test_page_of_a_half_without_results_says_so_and_has_none(page, tmp_path):
    empty = Page(page.whole, "validation")
    text = empty.write(tmp_path / "page.md", "python -m benchmarks.suite out/bench").read_text()
    assert "No clip" in empty.leaderboard() and not (tmp_path / "page").exists()
    assert "## What is in it" in text and "## Submit your own" in text and "## Leaderboard" not in text


def test_scores_that_cannot_be_read_are_told_in_a_sentence(repository, capsys):
    (repository / "external/honest.csv").write_text("case,view\na_ideal,mid\n")
    assert run(repository) == 2
    errors = capsys.readouterr().err
    assert "external/honest.csv: has no column size_px: evaluate that tracker again" in errors
    assert "Traceback" not in errors


def test_folder_without_a_repository_is_refused(tmp_path, capsys):
    assert run(tmp_path) == 2
    assert "is not a repository" in capsys.readouterr().err

"""The page: its conditions, who is ahead, its bytes, and what a person wrote into it."""

import shutil
import sys

import numpy as np
import pandas as pd
import pytest

from echotruth.benchmark import tables
from echotruth.benchmark.conditions import groups, main_conditions, variations, with_conditions
from echotruth.benchmark.page import Page
from echotruth.benchmark.standings import METRICS, RANKED_BY, order, standings, varied
from echotruth.cli import main

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


def test_cells_of_a_table_cannot_end_it():
    assert tables.markdown(["a"], [["x | y"]]).splitlines()[-1] == "| x \\| y |"


def run(*arguments):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["echotruth", "benchmark", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main()
    return left.value.code


def test_command_writes_the_page_twice_alike_and_keeps_what_a_person_wrote(repository, tmp_path, capsys):
    (repository / "ledger/evaluation/b_ideal/mid.json").unlink()
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


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--check", "nobody"], "nobody: the motion that it tracked is not kept in"),
        (["--check", "honest", "--size", "100"], "--size 100: is not an image size of"),
        (["--check", "honest", "--jobs", "0"], "--jobs 0: must be 1 or more"),
        (["--card", "absent.yaml"], "absent.yaml: cannot be read"),
        (["--page", "page"], "--page page: must be a Markdown file: give a name that ends in .md"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(submitted, capsys, arguments, sentence):
    assert run(submitted, *arguments) == 2
    errors = capsys.readouterr().err
    assert sentence in errors and "Traceback" not in errors


def test_page_of_a_half_without_results_says_so_and_has_none(page, tmp_path):
    empty = Page(page.whole, "validation")
    text = empty.write(tmp_path / "page.md", "echotruth benchmark out/bench").read_text()
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

"""Which hearts the figures and scores take in, and where they stand."""

import numpy as np
import pandas as pd
import pytest
from finished_repository import begin, configured, finish

from echotruth.config import Cases, Physiology
from echotruth.report import population
from echotruth.report.figures import OF_HEARTS, OF_TRACKERS, Figures
from echotruth.repository.reader import Repository


def repository(tmp_path, statuses, exclude):
    """A repository of which nothing but the verdicts is there."""
    config = configured(seeds=range(len(statuses)), physiology=Physiology(exclude_implausible=exclude))
    cases = [case.id for case in begin(tmp_path / "small", config)]
    read = Repository(tmp_path / "small")
    read.cases = pd.DataFrame({"status": statuses}, index=cases)
    return read, cases


@pytest.mark.parametrize("exclude", [True, False])
def test_only_complete_hearts_are_shown_where_there_are_any(tmp_path, exclude):
    read, cases = repository(tmp_path, ["implausible", "complete", "failed", "complete", "unfinished"], exclude)
    assert read.shown == [cases[1], cases[3]]


def test_implausible_hearts_are_shown_where_there_are_no_others_and_they_were_imaged(tmp_path):
    read, cases = repository(tmp_path, ["failed", "implausible"], exclude=False)
    assert read.shown == [cases[1]]


def test_without_a_heart_a_sentence_stands_in_place_of_every_figure(tmp_path):
    drawn = Figures(repository(tmp_path, ["failed", "implausible"], exclude=True)[0], tmp_path)
    drawn.draw(2)
    names = {*OF_HEARTS, "population", *OF_TRACKERS}
    assert {path.stem for path in tmp_path.glob("*.png")} == {path.stem for path in tmp_path.glob("*.svg")} == names
    assert {path.name for path in tmp_path.glob("*.[gmc]*")} == {"clip.mp4", "leaderboard.csv"}


@pytest.mark.slow
def test_hearts_of_the_leaderboard_are_told_apart_by_their_label(tmp_path):
    """All of these cases move alike."""
    table = "case,seed,label.heart\na,1,20240101\nb,2,20240102\n"
    config = configured(name="labelled", views=("mid",), cases=Cases(table=table))
    folder = finish(tmp_path / "labelled", config)
    found = Figures(Repository(folder), folder / "figures").standings
    assert set(found["hearts"]) == {2}


def test_heart_is_a_dot_of_each_of_its_findings():
    figure = population.draw({"EF": np.array([60.0, 40.0, 50.0])}, np.array(["healthy", "weak+dilation", "weak"]))
    (panel,) = figure.axes
    assert [label.get_text() for label in panel.get_yticklabels()] == ["healthy (1)", "dilation (1)", "weak (2)"]
    assert [sorted(line.get_xdata()) for line in panel.lines] == [[60], [40], [40, 50]]

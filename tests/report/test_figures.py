"""Which hearts the figures and scores take in."""

import pytest
from finished_repository import configured, finish

from echotruth.cases import expand
from echotruth.config import Cases, Physiology
from echotruth.report.figures import NAMES, Figures
from echotruth.repository.layout import lay_out
from echotruth.repository.reader import Repository
from echotruth.repository.store import Store

pytestmark = pytest.mark.filterwarnings("ignore")  # of the little store that stands for a repository


def repository(tmp_path, statuses, exclude):
    """A repository of which nothing but the verdicts is there."""
    cases = [{"seed": number} for number in range(len(statuses))]
    config = configured(cases=Cases(table="seed\n" + "\n".join(str(case["seed"]) for case in cases) + "\n"))
    config = config.model_copy(update={"physiology": Physiology(exclude_implausible=exclude)})
    hearts = expand(config)
    lay_out(tmp_path / "small", config, hearts)
    Store(tmp_path / "small/small.zarr").write_column("status", statuses)
    return Repository(tmp_path / "small"), [case.id for case in hearts]


@pytest.mark.parametrize("exclude", [True, False])
def test_only_complete_hearts_are_shown_where_there_are_any(tmp_path, exclude):
    read, cases = repository(tmp_path, ["implausible", "complete", "failed", "complete", "retired"], exclude)
    assert read.shown == [cases[1], cases[3]]


def test_implausible_hearts_are_shown_where_there_are_no_others_and_they_were_imaged(tmp_path):
    read, cases = repository(tmp_path, ["failed", "implausible"], exclude=False)
    assert read.shown == [cases[1]]


def test_without_a_heart_a_sentence_stands_in_place_of_every_figure(tmp_path):
    drawn = Figures(repository(tmp_path, ["failed", "implausible"], exclude=True)[0], tmp_path)
    drawn.draw()
    names = set(NAMES)
    assert {path.stem for path in tmp_path.glob("*.png")} == {path.stem for path in tmp_path.glob("*.svg")} == names
    assert {path.name for path in tmp_path.glob("*.[gmc]*")} == {"clip.gif", "clip.mp4", "leaderboard.csv"}


@pytest.mark.slow
@pytest.mark.parametrize(("label", "hearts"), [("heart", 2), ("group", 3)])
def test_hearts_of_the_leaderboard_are_told_apart_by_their_label(tmp_path, label, hearts):
    """Without one, cases are hearts, although these have the same motion."""
    table = f"case,seed,label.{label}\na,1,20240101\nb,2,20240102\nc,3,20240101\n"
    config = configured(name="labelled", views=("mid",), cases=Cases(table=table))
    folder = finish(tmp_path / "labelled", config)
    found = Figures(Repository(folder), folder / "figures").standings
    assert set(found["hearts"]) == {hearts}

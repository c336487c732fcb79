"""Which hearts the figures and scores take in."""

import numpy as np
import pytest
import xarray as xr
from finished_repository import configured, finish

from echotruth.config import Cases, Config, Physiology
from echotruth.report.figures import PARTS, Figures

pytestmark = pytest.mark.filterwarnings("ignore")  # of the little store that stands for a repository


def figures(tmp_path, statuses, exclude):
    """Figures of a repository of which nothing but the verdicts is there."""
    xr.DataTree.from_dict({"/cases": xr.Dataset({"status": ("case", np.array(statuses))})}).to_zarr(tmp_path / "a.zarr")
    return Figures(tmp_path / "a.zarr", Config(physiology=Physiology(exclude_implausible=exclude)), tmp_path)


@pytest.mark.parametrize("exclude", [True, False])
def test_only_complete_hearts_are_shown_where_there_are_any(tmp_path, exclude):
    shown = figures(tmp_path, ["implausible", "complete", "failed", "complete", "retired"], exclude)
    assert list(shown.complete) == [1, 3]


def test_implausible_hearts_are_shown_where_there_are_no_others_and_they_were_imaged(tmp_path):
    assert list(figures(tmp_path, ["failed", "implausible"], exclude=False).complete) == [1]


def test_without_a_heart_a_sentence_stands_in_place_of_every_figure(tmp_path):
    drawn = figures(tmp_path, ["failed", "implausible"], exclude=True)
    for part in PARTS:
        drawn.draw(part)
    names = {name for part in PARTS.values() for name in part}
    assert {path.stem for path in tmp_path.glob("*.png")} == {path.stem for path in tmp_path.glob("*.svg")} == names
    assert {path.name for path in tmp_path.glob("*.[gmc]*")} == {"clip.gif", "clip.mp4", "leaderboard.csv"}


@pytest.mark.slow
@pytest.mark.parametrize(("label", "hearts"), [("heart", 2), ("group", 3)])
def test_hearts_of_the_leaderboard_are_told_apart_by_their_label(tmp_path, label, hearts):
    """Without one, cases are hearts, although these have the same motion."""
    table = f"case,seed,label.{label}\na,1,20240101\nb,2,20240102\nc,3,20240101\n"
    config = configured(name="labelled", views=("mid",), cases=Cases(table=table))
    folder = finish(tmp_path / "labelled", config)
    found = Figures(folder / "labelled.zarr", config, folder / "figures").standings
    assert set(found["hearts"]) == {hearts}

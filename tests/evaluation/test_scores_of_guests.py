"""Scores of external trackers count for unchanged clips only, and a table that cannot be read gives one sentence."""

import pytest
from board import Board

from echotruth.config import Bmode, Config, PhaseCorrelation, Tracking, View
from echotruth.evaluation.leaderboard import rows

CONFIG = Config(
    views={"mid": View(), "null": View(position=0.7)},
    bmode=Bmode(size_px=64, downsampling=(1,)),
    tracking=Tracking(trackers={"ours": PhaseCorrelation(window_px=16)}),
)


@pytest.fixture
def read(tmp_path):
    """A repository of one heart and two views."""
    (tmp_path / "external").mkdir()
    versions = {(f"{stage}/64", "a", view): {"version": "0"} for stage in ("bmode", "truth") for view in CONFIG.views}
    return Board(CONFIG, tmp_path, {"a": dict.fromkeys(CONFIG.views, (0.1,))}, versions)


@pytest.fixture
def board(read):
    """Rows of its leaderboard."""
    return lambda: rows(read)


@pytest.fixture
def file(read, tmp_path):
    """Table of an external tracker that was scored on both clips."""
    table = rows(read).assign(tracker="mine", clip=[read.version("a", view) for view in CONFIG.views])
    table.to_csv(tmp_path / "external/mine.csv", index=False)
    return tmp_path / "external/mine.csv"


def views(board):
    table = board()
    return list(table["view"][table["tracker"] == "mine"])


def test_external_tracker_stands_under_the_name_of_its_file_on_clips_that_are_what_they_were(board, file, caplog):
    assert views(board) == ["mid", "null"] and not caplog.messages
    assert board()["size_px"].tolist() == [64] * 4 and board()["failure"].eq("").all()


@pytest.mark.parametrize("stage", ["bmode", "truth"])
def test_scores_of_older_images_are_left_out_and_told_of(board, read, file, stage, caplog):
    read.about[f"{stage}/64", "a", "mid"] = {"version": "1"}
    assert views(board) == ["null"]
    older = "1 of 2 rows are of older images or other points: evaluate that tracker again"
    assert caplog.messages == [f"external/mine.csv: {older}"]


def test_scores_of_unknown_images_are_left_out(board, file):
    lines = [line.split(",") for line in file.read_text().splitlines()]
    assert lines[0][-1] == "clip"
    file.write_text("".join(",".join(line[:-1]) + "\n" for line in lines))
    assert views(board) == []


BROKEN = {
    "no number": lambda content: content.replace(b",mine,", b",mine,about ", 1),
    "no size": lambda content: content.replace(b",64,", b",small,", 1),
    "nothing": lambda content: b"",
    "no text": lambda content: b"\xff\xfe\x00" + content,
    "ragged": lambda content: content.replace(b"\n", b"\n,,,,", 1) + b"," * 99,
}


@pytest.mark.parametrize("case", BROKEN)
def test_table_that_cannot_be_read_is_refused_in_one_sentence(board, file, case):
    file.write_bytes(BROKEN[case](file.read_bytes()))
    with pytest.raises(ValueError, match=r"mine\.csv: cannot be read \(.+\): evaluate that tracker again$") as refusal:
        board()
    assert "\n" not in str(refusal.value)

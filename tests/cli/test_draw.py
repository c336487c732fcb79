"""`echotruth draw`: what it says, and how it ends."""

import re
import signal
import subprocess
import sys

import numpy as np
import pytest


@pytest.fixture
def clip(tmp_path):
    """Path of a clip of four frames, which does not say its spacing."""
    np.save(tmp_path / "clip.npy", np.zeros((4, 90, 120), np.uint8))
    return tmp_path / "clip.npy"


def square(part, half):
    """Rows of a border, a square about a point."""
    corners = ((-half, -half), (half, -half), (half, half), (-half, half))
    return "".join(f"{part},{50 + x},{45 + y}\n" for x, y in corners)


WALL = "# view: mid\n# part: cycle 1 4, crop 10 0 110 90\npart,lateral_px,axial_px\n"
WALL += square("endocardium", 15) + square("epicardium", 25)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["no.dcm"], "no.dcm: is not there, or no file: give the path of a clip"),
        (
            ["clip.npy"],
            "clip.npy: does not say the side of its pixels and the time from frame to frame: give --spacing",
        ),
        (["clip.npy", "--frame-time-ms", "20"], "clip.npy: does not say the side of its pixels: give --spacing-mm"),
        (
            ["clip.npy", "--spacing-mm", "0.3"],
            "clip.npy: does not say the time from frame to frame: give --frame-time-ms",
        ),
        (
            ["clip.npy", "--spacing-mm", "-1", "--frame-time-ms", "20"],
            "--spacing-mm = -1: give a side from",
        ),
        (["KNOWN", "--cycle", "2", "1"], "cycle = 2, 1: give 3 or more of the 4 frames of clip.npy"),
        (["KNOWN", "--crop", "0", "0", "500", "10"], "crop = 0, 0, 500, 10: clip.npy is 120 x 90 px"),
        (["KNOWN", "--wall", "no.csv"], "no.csv: is not there"),
        (["KNOWN", "--wall", "no.csv", "-o", "no.csv"], "no.csv: is not there: give a wall to be corrected"),
        (["KNOWN", "-o", "wall.png"], "wall.png: cannot hold a wall: give a file of which the name ends in .csv"),
        (["KNOWN", "-o", "bad.csv"], "bad.csv: has no column part"),
    ],
)
def test_what_cannot_be_drawn_is_told_in_one_line(call, clip, tmp_path, arguments, sentence):
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    known = ["clip.npy", "--spacing-mm", "0.3", "--frame-time-ms", "20"]
    words = known + arguments[1:] if arguments[0] == "KNOWN" else arguments
    status, output, errors = call("draw", *words, "--no-browser")
    assert (status, output, errors.count("\n")) == (2, "", 1) and errors.startswith(f"echotruth: {sentence}"), errors


@pytest.mark.parametrize("command", ["draw", "show"])
def test_port_that_there_is_none_of_is_told_in_one_line(call, command):
    status, output, errors = call(command, "clip.npy", "--port", "99999")
    assert (status, output, errors.count("\n")) == (2, "", 1) and "--port: 99999: give a number from 1" in errors


DRAW = """
import signal
from echotruth.cli import main
# A shell may start background processes with SIGINT ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
main()
"""


def test_sector_that_is_shown_is_told(tmp_path):
    film = np.zeros((4, 90, 120), np.uint8)
    film[:, 20:70, 30:100] = np.random.default_rng(0).integers(0, 256, (4, 50, 70))
    np.save(tmp_path / "clip.npy", film)
    options = ["--spacing-mm", "0.3", "--frame-time-ms", "20", "--no-browser"]
    command = [sys.executable, "-m", "echotruth", "draw", str(tmp_path / "clip.npy"), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        process.terminate()
        assert process.stderr.read().endswith("clip.npy: shows what moves in it: --crop 29 19 101 71\n")


@pytest.mark.parametrize(("options", "shown"), [([], (1, 4)), (["--cycle", "0", "4"], (0, 4))])
def test_cycle_and_crop_of_the_wall_are_the_default(call, clip, monkeypatch, options, shown):
    from echotruth.echo import drawing

    clip.with_name("clip.wall.csv").write_text(WALL)
    clips = []
    monkeypatch.setattr(drawing.DrawingServer, "run", lambda self, ready: clips.append(self.drawing))
    call("draw", "clip.npy", "--spacing-mm", "0.3", "--frame-time-ms", "20", "--no-browser", *options)
    assert clips[0].clip.attrs["part"] == f"cycle {shown[0]} {shown[1]}, crop 10 0 110 90"
    assert clips[0].description()["cycle"] == (1 - shown[0], 4 - shown[0])


def test_cycle_that_does_not_hold_that_of_the_wall_is_refused(call, clip):
    clip.with_name("clip.wall.csv").write_text(WALL)
    options = ["--spacing-mm", "0.3", "--frame-time-ms", "20", "--cycle", "0", "3", "--no-browser"]
    status, output, errors = call("draw", "clip.npy", *options)
    assert (status, output, errors.count("\n")) == (2, "", 1)
    assert "clip.wall.csv: was drawn in frames 1 to 4, and the clip shows 0 to 3: give a cycle that" in errors


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_command_prints_the_address_and_ends_when_it_is_told(clip, number):
    options = ["--spacing-mm", "0.3", "--frame-time-ms", "20", "--crop", "20", "0", "110", "90", "--no-browser"]
    command = [sys.executable, "-c", DRAW, "draw", str(clip), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        line = process.stdout.readline()
        process.send_signal(number)
        assert process.stderr.read() == ""
    assert process.returncode == 0
    assert re.fullmatch(r".*clip.npy: http://127\.0\.0\.1:\d+/ \(Ctrl-C ends it\)\n", line)

"""`echotruth track`: strain of one's own echo."""

import argparse
import csv
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from echotruth.cli import recording
from echotruth.cli.command import fail, model, named
from echotruth.echo.failure import EchoError
from echotruth.echo.wall_file import default_output, said

VIEWS = "basal, mid or apical; four_chamber, two_chamber or three_chamber; short_axis or long_axis without segments"

TRACKERS = (
    *("corrected", "phase_correlation", "window_deformation"),
    *("bspline_dic", "bspline_cnn", "dis"),
)
"""Trackers of a default configuration and methods, which the help names without importing them."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth track`."""
    recording.add(parser, "all", several=True)
    text = (
        "borders of the wall at end-diastole, .csv or mask (default: CLIP with the ending .wall.csv); of one clip only"
    )
    parser.add_argument("--wall", type=Path, help=text)
    parser.add_argument("--view", help=f"{VIEWS} (default: what the .csv says)")
    text = f"{', '.join(TRACKERS)}, or package.module:function (default: bspline_dic)"
    tracker = parser.add_mutually_exclusive_group()
    tracker.add_argument("--tracker", default="bspline_dic", help=text)
    text = "in place of a tracker: a point tracker in ONNX, such as model.onnx (what it takes: model.yaml)"
    tracker.add_argument("--onnx", dest="tracker", type=model, metavar="MODEL", help=text)
    parser.add_argument("-o", "--output", type=Path, default=Path("strain"), help="folder (default: strain)")


def track(arguments: argparse.Namespace) -> int:
    """Track the wall in recorded clips, and take its strain.

    Of each clip it writes a page (NAME.png) and its curves (NAME.csv) into the folder, and a row into strain.csv, the
    table of all clips that are there. The wall is drawn at end-diastole: by `echotruth draw`, of which the cycle and
    the crop are taken over, or by another program as a table of columns part (endocardium, epicardium,
    anterior_insertion, inferior_insertion), lateral_px and axial_px.

    examples:
      echotruth track mouse.dcm
      echotruth track *.dcm --view four_chamber -o strain
      echotruth track mouse.mp4 --wall ring.png --view short_axis --spacing-mm 0.03 --frame-time-ms 4

    exit status:
      0  all clips are tracked
      1  some are not: each is named
      2  none is, or an option is wrong
    """
    clips: list[Path] = arguments.clip
    walls = [arguments.wall or default_output(path) for path in clips]
    table = arguments.output / "strain.csv"
    _check_options(arguments)
    names = _names(clips, walls, arguments.output, _sources(table))
    lacking = [_lacking(path, wall, arguments) for path, wall in zip(clips, walls, strict=True)]
    if all(lacking):
        return fail("\n".join(lacking))
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = list(_rows(zip(clips, walls, names, lacking, strict=True), arguments))
    if not rows:
        return 2
    _write_table(rows, table)
    return 0 if len(rows) == len(clips) else 1


def _check_options(arguments: argparse.Namespace) -> None:
    """Raise an EchoError if one wall is given for several clips, or a ValueError if there is no such tracker."""
    clips, tracker = len(arguments.clip), arguments.tracker
    if arguments.wall and clips > 1:
        raise EchoError(f"--wall {arguments.wall}: suits one clip: name those of {clips} clips CLIP.wall.csv")
    if tracker not in TRACKERS:
        from echotruth.config.building import tracker_values

        tracker_values(tracker, {})


def _rows(clips: Iterable[tuple[Path, Path, str, str]], arguments: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Track clips, each with its wall, its name and what it lacks; yield a row of each that can be tracked."""
    several = len(arguments.clip)
    for number, (path, wall, name, lacks) in enumerate(clips, 1):
        if several > 1:
            print(f"{number} of {several}: {path}", file=sys.stderr)
        try:
            if lacks:
                raise EchoError(lacks)
            yield _tracked(path, wall, name, arguments)
        except (EchoError, ValueError) as error:
            print(named(str(error)), file=sys.stderr)


def _lacking(clip: Path, wall: Path, arguments: argparse.Namespace) -> str:
    """What has to be given of a clip and its wall before it is worth reading them, in a sentence; or nothing."""
    if not clip.exists():
        return f"{clip}: is not there: give the path of a clip"
    names = recording.missing(clip, arguments)
    if not wall.is_file():
        draw = f"{wall}: is not there: draw the wall (echotruth draw {clip})"
        return f"{recording.asked(clip, names)}; {draw}" if names else draw
    if not (arguments.view or said(wall, "view")):
        names.append("view")
    return recording.asked(clip, names) if names else ""


def _name(clip: str | Path) -> str:
    """Name of a clip without its folder and ending."""
    return default_output(Path(clip)).name.removesuffix(".wall.csv")


def _names(clips: list[Path], walls: list[Path], output: Path, before: list[str]) -> list[str]:
    """Names of what is written of the clips: none may take the place of another, of the table or of what is read.

    Raises
    ------
    EchoError
        If one would.
    """
    taken = {_name(source): Path(source) for source in before}
    kept = {path.resolve() for path in (*clips, *walls, output / "strain.csv")}
    names: list[str] = []
    for path in clips:
        name = _name(path)
        if taken.setdefault(name, path).resolve() != path.resolve() or name in names:
            raise EchoError(f"{path}: has the name of {taken[name]}: track it into another folder (--output)")
        for written in (output / f"{name}.png", output / f"{name}.csv"):
            if written.resolve() in kept:
                raise EchoError(f"{path}: would be written to {written}, which is another file: give another --output")
        names.append(name)
    return names


def _sources(table: Path) -> list[str]:
    """Clips that were tracked into a folder before.

    Raises
    ------
    EchoError
        If there is another table.
    """
    if not table.exists():
        return []
    try:
        with table.open(newline="", encoding="utf-8") as file:
            return [row["source"] for row in csv.DictReader(file)]
    except (OSError, ValueError, KeyError, csv.Error):
        raise EchoError(f"{table}: is no table of tracked clips: track into another folder (--output)") from None


def _tracked(path: Path, drawn: Path, name: str, arguments: argparse.Namespace) -> dict[str, Any]:
    """Track one clip in the wall that was drawn, write its page and its curves, and return its row of the table."""
    from echotruth.echo import page
    from echotruth.echo.strain import speckle_tracking
    from echotruth.echo.wall import read_wall

    wall = read_wall(drawn, arguments.view)
    clip = recording.read(path, arguments, wall.part)
    frames = clip.sizes["frame"]
    print(f"{path}: tracks {frames} frames by {arguments.tracker} ({clip.attrs['part']})", file=sys.stderr)
    strain = speckle_tracking(clip, wall, arguments.tracker)
    page.draw(clip, strain, arguments.output / f"{name}.png")
    page.curves(strain).to_csv(arguments.output / f"{name}.csv", index=False, float_format="%.4f")
    row = page.summary(strain)
    for note in str(strain.attrs["notes"]).splitlines():
        print(named(f"{path}: {note}"), file=sys.stderr)
    print(f"{path}: {page.headline(strain)}, {arguments.output / name}.png")
    return row


def _write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write the table of all clips, in which new rows of a clip take the place of earlier ones."""
    import pandas as pd

    tracked = {_name(row["source"]) for row in rows}
    before = pd.read_csv(path).to_dict("records") if path.exists() else []
    others = [row for row in before if _name(str(row["source"])) not in tracked]
    pd.DataFrame([*others, *rows]).to_csv(path, index=False, float_format="%.3f")

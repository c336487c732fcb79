"""`echotruth track`: strain of one's own echo."""

import argparse
import sys
from pathlib import Path
from typing import Any

from echotruth.cli import recording
from echotruth.cli.command import fail, named

VIEWS = "basal, mid or apical; four_chamber, two_chamber or three_chamber; short_axis or long_axis without segments"


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth track`."""
    recording.add(parser, several=True)
    text = (
        "borders of the wall at end-diastole, .csv or mask (default: CLIP with the ending .wall.csv); of one clip only"
    )
    parser.add_argument("--wall", type=Path, help=text)
    parser.add_argument("--view", help=f"{VIEWS} (default: what the .csv says)")
    parser.add_argument("--tracker", default="bspline_dic", help="method of tracking (default: bspline_dic)")
    parser.add_argument("-o", "--output", type=Path, default=Path("strain"), help="folder (default: strain)")


def track(arguments: argparse.Namespace) -> int:
    """Track the wall in recorded clips, and take its strain.

    Of each clip it writes a page (NAME.png) and its curves (NAME.csv), and of all together the table strain.csv, into
    the folder. The wall is drawn at end-diastole: by `echotruth draw`, or by another program as a table of columns
    part (endocardium, epicardium, anterior_insertion, inferior_insertion), lateral_px and axial_px.

    examples:
      echotruth track mouse.dcm
      echotruth track *.dcm --view four_chamber -o strain
      echotruth track mouse.mp4 --wall ring.png --view short_axis --spacing-mm 0.03 --frame-time-ms 4

    exit status:
      0  all clips are tracked
      1  some are not: each is told
      2  none is, or an option is wrong
    """
    from echotruth.echo.drawing import default_output
    from echotruth.echo.failure import EchoError

    clips: list[Path] = arguments.clip
    if arguments.wall and len(clips) > 1:
        return fail(f"--wall {arguments.wall}: suits one clip: name those of {len(clips)} clips CLIP.wall.csv")
    walls = [arguments.wall or default_output(path) for path in clips]
    names = [default_output(path).name.removesuffix(".wall.csv") for path in clips]
    if twice := next((name for name in names if names.count(name) > 1), None):
        return fail(f"{twice}: two clips have this name: track them into folders of their own (--output)")
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    for number, (path, wall, name) in enumerate(zip(clips, walls, names, strict=True), 1):
        if len(clips) > 1:
            print(f"{number} of {len(clips)}: {path}", file=sys.stderr)
        try:
            rows.append(_tracked(path, wall, name, arguments))
        except (EchoError, ValueError) as error:
            print(named(str(error)), file=sys.stderr)
    if not rows:
        return 2
    _write_table(rows, arguments.output / "strain.csv")
    return 0 if len(rows) == len(clips) else 1


def _tracked(path: Path, drawn: Path, name: str, arguments: argparse.Namespace) -> dict[str, Any]:
    """Track one clip in the wall that was drawn, write its page and its curves, and return its row of the table."""
    from echotruth.echo import page
    from echotruth.echo.strain import speckle_tracking
    from echotruth.echo.wall import read_wall

    wall = read_wall(drawn, arguments.view)
    clip = recording.read(path, arguments)
    strain = speckle_tracking(clip, wall, arguments.tracker)
    page.draw(clip, strain, arguments.output / f"{name}.png")
    page.curves(strain).to_csv(arguments.output / f"{name}.csv", index=False, float_format="%.4f")
    row = page.summary(strain)
    kind, value = page.global_strain(strain)
    for note in str(strain.attrs["notes"]).splitlines():
        print(named(f"{path}: {note}"), file=sys.stderr)
    print(f"{path}: {kind} {value:.1f} %, {arguments.output / name}.png")
    return row


def _write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write the table of all clips."""
    import pandas as pd

    pd.DataFrame(rows).to_csv(path, index=False, float_format="%.3f")

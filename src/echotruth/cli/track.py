"""`echotruth track`: strain of one's own echo."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echotruth.cli import recording
from echotruth.cli.command import fail, named

if TYPE_CHECKING:
    import pandas as pd

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

    Of each clip it writes a page (NAME.png) and its curves (NAME.csv) into the folder, and a row into strain.csv, the
    table of all clips that are there. The wall is drawn at end-diastole: by `echotruth draw`, or by another program as
    a table of columns part (endocardium, epicardium, anterior_insertion, inferior_insertion), lateral_px and axial_px.

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
    table = arguments.output / "strain.csv"
    try:
        before = _rows(table)
        names = _names(clips, walls, arguments.output, before)
    except EchoError as error:
        return fail(str(error))
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
    _write_table(rows, before, table)
    return 0 if len(rows) == len(clips) else 1


def _name(clip: str | Path) -> str:
    """Name of a clip without its folder and ending."""
    from echotruth.echo.drawing import default_output

    return default_output(Path(clip)).name.removesuffix(".wall.csv")


def _names(clips: list[Path], walls: list[Path], output: Path, before: "pd.DataFrame") -> list[str]:
    """Names of what is written of the clips: none may take the place of another, of the table or of what is read.

    Raises
    ------
    EchoError
        If one would.
    """
    from echotruth.echo.failure import EchoError

    taken = {_name(source): Path(source) for source in before["source"].astype(str)}
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


def _rows(table: Path) -> "pd.DataFrame":
    """Rows of clips that were tracked into a folder before.

    Raises
    ------
    EchoError
        If there is another table.
    """
    import pandas as pd

    from echotruth.echo.failure import EchoError

    if not table.exists():
        return pd.DataFrame({"source": []})
    try:
        rows = pd.read_csv(table)
    except (OSError, ValueError):
        rows = pd.DataFrame()
    if "source" not in rows:
        raise EchoError(f"{table}: is no table of tracked clips: track into another folder (--output)")
    return rows


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


def _write_table(rows: list[dict[str, Any]], before: "pd.DataFrame", path: Path) -> None:
    """Write the table of all clips, in which new rows of a clip take the place of earlier ones."""
    import pandas as pd

    tracked = {_name(row["source"]) for row in rows}
    others = before[[_name(source) not in tracked for source in before["source"].astype(str)]]
    pd.DataFrame([*others.to_dict("records"), *rows]).to_csv(path, index=False, float_format="%.3f")

"""`echotruth draw`: the wall of a ventricle, drawn in a clip in the browser."""

import argparse
import sys
from pathlib import Path

from echotruth.cli import recording
from echotruth.cli.command import add_page, fail, show_page
from echotruth.echo.wall_file import default_output, part, said


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth draw`."""
    recording.add(parser, "what moves in it")
    text = "the wall that is written (default: that of the clip with the ending .wall.csv)"
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.csv", help=text)
    text = "table or mask of a wall to be corrected (default: the output, if it is there)"
    parser.add_argument("--wall", type=Path, metavar="FILE", help=text)
    add_page(parser)


def draw(arguments: argparse.Namespace) -> int:
    """Draw the wall of a ventricle in one's own echo.

    A page in the browser shows the clip. The frame at end-diastole is chosen, points of the endocardium and the
    epicardium are clicked in it, and both are saved as a table that `echotruth.read_wall` reads (docs/drawing.md). Only
    this machine can open the page; Ctrl-C ends it.

    examples:
      echotruth draw patient.dcm
      echotruth draw mouse.avi --spacing-mm 0.05 --frame-time-ms 4 --cycle 3 31 -o mid.csv
      echotruth draw patient.dcm --wall segmented.png -o patient.wall.csv

    exit status:
      0  the page was closed
      2  the clip or the wall cannot be shown
    """
    if names := recording.missing(arguments.clip, arguments):
        return fail(recording.asked(arguments.clip, names))
    from echotruth.echo import drawing

    output = arguments.output or default_output(arguments.clip)
    begin = arguments.wall or output
    finds_sector = not (arguments.crop or begin.is_file())
    if finds_sector:
        arguments.crop = "sector"
    clip = recording.read(arguments.clip, arguments, said(begin, "part") or "")
    server = drawing.DrawingServer(drawing.Drawing(clip, output, arguments.wall), arguments.port)
    if finds_sector and (shown := part(clip.attrs["part"])):
        crop = " ".join(map(str, shown.crop))
        print(f"{arguments.clip}: shows what moves in it: --crop {crop}", file=sys.stderr)
    server.run(lambda: show_page(arguments, arguments.clip, server.address))
    return 0

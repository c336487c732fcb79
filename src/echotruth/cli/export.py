"""`echotruth export`: clips, hearts or RF as files of other programs."""

import argparse
import sys
from pathlib import Path

from echotruth.cli.command import add_repeated, fail

EXPORTED = ("mp4", "gif", "png", "nifti", "dicom", "vtk", "vti", "csv", "tap", "uff", "zea", "echoxflow")
"""Formats of `echotruth export`."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth export`."""
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("--format", choices=EXPORTED, required=True, help="format of the files")
    add_repeated(
        parser,
        ("case", str, "case id from cases.csv; can be repeated (default: all)"),
        ("view", str, "name of the view; can be repeated (default: all)"),
        ("size", int, "image size, px; can be repeated (default: the largest)"),
        ("tracker", str, "tracker for csv; can be repeated (default: all)"),
        ("overlay", str, "wall, segments, tissue or displacement over mp4, gif and png; can be repeated"),
    )
    parser.add_argument("--rate", type=float, help="frames per second of mp4 and gif (default: 20)")
    parser.add_argument(
        "-o", "--output", type=Path, help="folder, or the file if it is one (default: export/FORMAT in the repository)"
    )


def export(arguments: argparse.Namespace) -> int:
    """Write clips, hearts or RF of a repository as files of other programs.

    There is one file for each clip, CASE_VIEW_SIZE.

    examples:
      echotruth export out/demo --format mp4 --view mid --overlay wall
      echotruth export out/demo --format csv --tracker dis

    exit status:
      0  all files are written
      2  they cannot be exported
    """
    from echotruth.repository.reader import Repository
    from echotruth.sharing.export import Export

    chosen = arguments.case, arguments.view, arguments.size, arguments.tracker
    try:
        how = arguments.overlay, arguments.rate, arguments.output
        work = Export(Repository(arguments.repository), arguments.format, *chosen, *how)
        clips, left_out = work.clips()
        for path in work.write(clips):
            print(path, flush=True)
    except (FileExistsError, NotADirectoryError) as error:
        return fail(f"{error.filename}: is a file and not a folder: give another folder with --output")
    except KeyboardInterrupt:
        return fail("interrupted; the files that were named are whole")
    if left_out:
        print(f"echotruth: left out {len(left_out)} that are not finished, first: {left_out[0]}", file=sys.stderr)
    return 0

"""`echotruth evaluate`: a tracker on every clip of a repository."""

import argparse
from pathlib import Path

from echotruth.cli.command import add_repeated, fail, model


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth evaluate`."""
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    tracker = parser.add_mutually_exclusive_group(required=True)
    tracker.add_argument("--tracker", help="package.module:function, an entry point, or a method such as dis")
    text = "a point tracker in ONNX, such as model.onnx (what it takes: model.yaml)"
    tracker.add_argument("--onnx", dest="tracker", type=model, metavar="MODEL", help=text)
    # `arguments.command` is the name of the subcommand.
    tracker.add_argument("--command", dest="program", help='a program, such as "track {input} {output}"')
    parser.add_argument("--timeout", type=float, help="longest time of the program per clip, s (default: 3600)")
    parser.add_argument("--name", help="name of the tracker in the repository (default: derived from the tracker)")
    add_repeated(
        parser,
        ("option", str, "key=value for the tracker; can be repeated"),
        ("case", str, "case id from cases.csv; can be repeated (default: all)"),
        ("view", str, "name of the view; can be repeated (default: all)"),
    )
    parser.add_argument(
        "--jobs", type=int, default=1, help="processes at a time (default: 1); scores do not depend on it"
    )


def evaluate(arguments: argparse.Namespace) -> int:
    """Run a tracker on every clip of a repository, and add it to the trackers of the repository.

    It is scored by what scores the other trackers, and stands beside them in the leaderboard of the report,
    which the next run draws.

    A tracker is a function track(frames, points, mask, spacing, frame_time, seed), which returns the
    displacement (frame, point, 2) since frame 0 in pixels, lateral and axial, of points (point, 2); or a
    program that reads and writes the same arrays in NumPy's .npz.

    examples:
      echotruth evaluate out/demo --tracker mypackage.module:track
      echotruth evaluate out/demo --tracker dis --option preset=fast
      echotruth evaluate out/demo --onnx model.onnx
      echotruth evaluate out/demo --command "track {input} {output}" --name mine

    exit status:
      0  it tracked a clip
      1  it failed on every clip
      2  it cannot be evaluated
    """
    from echotruth.evaluation.availability import check_runs
    from echotruth.evaluation.tracker_options import parse_tracker
    from echotruth.repository.reader import Repository
    from echotruth.workflow.added_tracker import format_row, prepare, summary

    rows = []
    name, settings = parse_tracker(arguments.tracker, arguments.program, arguments.option, arguments.timeout)
    added = prepare(Repository(arguments.repository), arguments.name or name, settings)
    case_views = added.case_views(arguments.case, arguments.view)
    check_runs(added.settings)
    for row in added.rows(case_views, arguments.jobs):
        print(format_row(row), flush=True)
        rows.append(row)
    if not rows:
        return fail(f"{added.repository.folder}: its hearts are outside their bounds, so that no clip is tracked")
    print(f"\n{summary(rows)}\n\n{added.name} is a tracker of {added.repository.folder}")
    return 0 if any(not row["failure"] for row in rows) else 1

"""`echotruth infer`: parameters of the hearts of a repository, from what a tracker saw of them."""

import argparse
import sys
from pathlib import Path

from echotruth.cli.command import add_repeated, fail, named


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth infer`."""
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("--tracker", help="name of the tracker in the repository (default: its last one)")
    add_repeated(parser, ("case", str, "case id from cases.csv; can be repeated (default: all)"))
    parser.add_argument("--size", type=int, help="image size, px (default: the largest)")
    parser.add_argument("--errors", type=Path, help="table of the errors of trackers, .csv (default: the benchmark's)")
    text = "table that is written (default: inference.csv in the folder of the repository)"
    parser.add_argument("-o", "--output", type=Path, help=text)


def infer(arguments: argparse.Namespace) -> int:
    """Infer the contractility of segments, with intervals, from what a tracker saw of the hearts of a repository.

    The table has a row for each heart and parameter: mean, standard deviation and 90 % interval, those of the prior,
    whether it is identifiable, the probability of a scar, and its true value. A heart takes one to
    four minutes; the key inference.tracker makes it a stage of a run, which keeps the draws and does nothing twice.

    examples:
      echotruth infer out/demo --tracker bspline_dic --size 256
      echotruth infer out/hearts --tracker dis --size 128 --output dis.csv

    exit status:
      0  all hearts are inferred
      1  some are not: each is named
      2  none is, or an option is wrong
    """
    from echotruth.inference.stored import rows
    from echotruth.repository.inferred import FILE, table_of, write
    from echotruth.repository.reader import Repository

    table: list[dict[str, object]] = []
    failed = 0
    repository = Repository(arguments.repository)
    if repository.is_sample and arguments.output is None:
        return fail(f"{arguments.repository}: is part of the package: name a file by --output")
    if repository.config.inference.tracker and arguments.output is None:
        return fail(f"{repository.folder / FILE}: is what the run inferred: name another file by --output")
    cases = arguments.case or repository.shown
    output = arguments.output or repository.folder / FILE
    if not output.parent.is_dir():
        return fail(f"--output {output}: there is no folder {output.parent}: make it, or name another")
    for number, case in enumerate(cases, 1):
        print(f"{number} of {len(cases)}: {case}", file=sys.stderr)
        try:
            table += rows(repository, arguments.tracker, case, arguments.size, arguments.errors)
        except (ValueError, RuntimeError) as error:
            print(named(f"{case}: {str(error).removeprefix(f'{case}: ')}"), file=sys.stderr)
            failed += 1
            continue
        # After every heart, so that what was inferred is not lost if the rest is stopped.
        write(output, table_of(table))
    if not table:
        return 2 if failed else fail(f"{arguments.repository}: has no heart that is complete: run it to its end")
    print(f"Parameters: {output}")
    return 1 if failed else 0

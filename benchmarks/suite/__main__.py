"""The suite of hearts on which trackers are ranked; docs/benchmark.md says more.

    python -m benchmarks.suite part 1 --jobs 2
    python -m benchmarks.suite part small
    python -m benchmarks.suite part 1 --tracker mine.yaml
    python -m benchmarks.suite page

The exit status is 0 if it is done, and 2 if it cannot be done.
"""

from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from pathlib import Path

from echotruth.extras import MissingPackage, explained
from echotruth.workflow import instructions

PROGRAM = "python -m benchmarks.suite"


def parser() -> argparse.ArgumentParser:
    """Parser of the command line."""
    whole = argparse.ArgumentParser(
        prog=PROGRAM, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = whole.add_subparsers(dest="command", required=True)
    part = commands.add_parser("part", help="make eight hearts and score")
    part.add_argument("part", help="its number, or small")
    part.add_argument("--jobs", type=int, default=1, help="processes (default: 1); scores do not depend on it")
    part.add_argument("--tracker", type=Path, help="YAML file of further trackers, whose scores go beside the part")
    table = commands.add_parser("page", help="write the page, from the parts alone")
    table.add_argument("--split", choices=("develop", "test"), default="test", help="hearts to report (default: test)")
    table.add_argument("--page", type=Path, default=Path("docs/benchmark.md"), help="file (default: %(default)s)")
    return whole


def main() -> int:
    """Do what the command line asks for; the exit status."""
    given = parser().parse_args()
    try:
        with explained(PROGRAM):
            from . import page, parts

            if given.command == "page":
                print(page.write(parts.read_parts(), given.page, given.split))
            else:
                part, say = parts.number(given.part), partial(print, flush=True)
                print(parts.make_part(part, given.jobs, given.tracker, say))
    except (ValueError, OSError, MissingPackage) as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return 2
    return 0


def set_instructions() -> None:
    """Start this program anew with the instructions of a run; NumPy, which tells what to set, is loaded by then."""
    wanted = os.environ | instructions.environment()
    if wanted != dict(os.environ):
        os.execve(sys.executable, sys.orig_argv, wanted)


if __name__ == "__main__":
    set_instructions()
    sys.exit(main())

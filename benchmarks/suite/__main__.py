"""The suite of hearts on which trackers are ranked; docs/benchmark.md says more.

    python -m benchmarks.suite part 1 --jobs 2
    python -m benchmarks.suite part small
    python -m benchmarks.suite part 1 --tracker mine.yaml
    python -m benchmarks.suite page

The exit status is 0 if it is done, and 2 if it cannot be done.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

from . import page
from .parts import SMALL, make_part, read_parts

PROGRAM = "python -m benchmarks.suite"


def parser() -> argparse.ArgumentParser:
    """Parser of the command line."""
    whole = argparse.ArgumentParser(
        prog=PROGRAM, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = whole.add_subparsers(dest="command", required=True)
    part = commands.add_parser("part", help="make eight hearts and score")
    part.add_argument("part", type=number, help="its number, or small")
    part.add_argument("--jobs", type=int, default=1, help="processes (default: 1); scores do not depend on it")
    part.add_argument("--tracker", type=Path, help="YAML file of further trackers, whose scores go beside the part")
    table = commands.add_parser("page", help="write the page, from the parts alone")
    table.add_argument("--split", choices=("develop", "test"), default="test", help="hearts to report (default: test)")
    table.add_argument("--page", type=Path, default=Path("docs/benchmark.md"), help="file (default: %(default)s)")
    return whole


def number(part: str) -> int:
    """Number of a part that is given by its number or as `small`."""
    return SMALL if part == "small" else int(part)


def main() -> int:
    """Do what the command line asks for; the exit status."""
    given = parser().parse_args()
    try:
        if given.command == "page":
            print(page.write(read_parts(), given.page, given.split))
        else:
            print(make_part(given.part, given.jobs, given.tracker, partial(print, flush=True)))
    except (ValueError, OSError) as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

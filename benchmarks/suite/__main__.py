"""The leaderboard of repositories, its page, and the checks of a submission; docs/benchmark.md says more.

    python -m benchmarks.suite out/benchmark
    python -m benchmarks.suite out/benchmark out/benchmark_human --page benchmark.md
    python -m benchmarks.suite out/benchmark --card mine.yaml --check mine --page mine.md

The exit status is 0 if it is done, 1 if a check has found something that asks for an explanation, and 2 if it cannot
be done.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from echotruth.config.reading import ConfigError
from echotruth.evaluation.tracker_options import EvaluationError

from . import records
from .card import attach_card
from .page import Page, check_writable
from .rerun import rerun

PROGRAM = "python -m benchmarks.suite"


def parser() -> argparse.ArgumentParser:
    """Parser of the command line."""
    whole = argparse.ArgumentParser(
        prog=PROGRAM, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    whole.add_argument("repository", type=Path, nargs="+", help="folder of a repository, such as out/benchmark")
    whole.add_argument("--page", type=Path, help="write the page to this Markdown file, its figures beside it")
    whole.add_argument("--split", choices=("test", "develop"), default="test", help="hearts to report (default: test)")
    text = "number of processes (default: 1); results do not depend on it"
    whole.add_argument("--jobs", type=int, default=1, help=text)
    for name, kind, text in (
        ("card", Path, "card of a tracker that was evaluated, a YAML file, to keep beside its scores; can be repeated"),
        ("check", str, "run this tracker again on mirrored clips of the split and sizes; can be repeated"),
        ("open", str, "run this tracker again on the first half of the cycle of these clips; can be repeated"),
        ("size", int, "image size, px; can be repeated (default: all)"),
    ):
        whole.add_argument(f"--{name}", type=kind, action="append", default=[], help=text)
    return whole


def main() -> int:
    """Do what the command line asks for; the exit status."""
    given = parser().parse_args()
    try:
        return benchmark(given)
    except (EvaluationError, ConfigError) as error:
        lines = str(error).splitlines()
    except OSError as error:
        lines = [f"{error.filename}: {error.strerror}: see that the path is right and you may read and write there"]
    print("\n".join(f"{PROGRAM}: {line}" for line in lines), file=sys.stderr)
    return 2


def benchmark(given: argparse.Namespace) -> int:
    """Rank trackers; 1 if a check has found something, otherwise 0."""
    # What is wrong is told before trackers run for hours.
    records.read_suites(given.repository)
    if given.page is not None:
        check_writable(given.page)
    for card in given.card:
        print(f"Card: {attach_card(given.repository, card)}")
    for variant, trackers in (("mirrored", given.check), ("open", given.open)):
        for tracker in trackers:
            for line in rerun(given.repository, tracker, variant, given.split, given.size, given.jobs):
                print(line, flush=True)
    print("Reading the clips; their difficulty is computed the first time, in about 4 s a clip.", file=sys.stderr)
    page = Page(records.read(given.repository, given.size, given.jobs), given.split)
    print(page.leaderboard())
    if given.page is not None:
        print(f"\nPage: {page.write(given.page, command(given))}")
    verdicts = [page.verdict(tracker) for tracker in given.check]
    print("\n".join(verdict.text for verdict in verdicts))
    return 1 if any(verdict.flags for verdict in verdicts) else 0


def command(given: argparse.Namespace) -> str:
    """Command line that makes the page."""
    words = [*map(str, given.repository), *(["--split", given.split] if given.split != "test" else [])]
    words += [word for size in given.size for word in ("--size", str(size))]
    return f"{PROGRAM} {shlex.join([*words, '--page', str(given.page)])}"


if __name__ == "__main__":
    sys.exit(main())

"""`echotruth benchmark`: the leaderboard of repositories, its page, and the checks of a submission."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from echotruth.cli.command import Commands, add_command, add_repeated, fail


def add(commands: Commands) -> None:
    """Add the parser of `echotruth benchmark`."""
    parser = add_command(
        commands,
        benchmark,
        "rank the trackers of repositories by condition, write the page of the benchmark, check a submission",
        "See docs/benchmark.md.",
        [
            "benchmark out/benchmark",
            "benchmark out/benchmark out/benchmark_human --page benchmark.md",
            "benchmark out/benchmark --card mine.yaml --check mine --page mine.md",
        ],
        {0: "it is done", 1: "a check has found something that asks for an explanation", 2: "it cannot be done"},
    )
    parser.add_argument("repository", type=Path, nargs="+", help="folder of a repository, such as out/benchmark")
    parser.add_argument("--page", type=Path, help="write the page to this Markdown file, its figures beside it")
    parser.add_argument("--split", choices=("test", "develop"), default="test", help="hearts to report (default: test)")
    add_repeated(
        parser,
        ("card", Path, "card of a tracker that was evaluated, a YAML file, to keep beside its scores; can be repeated"),
        ("check", str, "run this tracker again on mirrored clips of the split and sizes; can be repeated"),
        ("open", str, "run this tracker again on the first half of the cycle of these clips; can be repeated"),
        ("size", int, "image size, px; can be repeated (default: all)"),
    )
    text = "number of processes (default: 1); results do not depend on it"
    parser.add_argument("--jobs", type=int, default=1, help=text)


def benchmark(arguments: argparse.Namespace) -> int:
    """Rank trackers; return 0, 1 if a check fails, or 2 if it cannot be done."""
    from echotruth.benchmark import records
    from echotruth.benchmark.page import Page, check_writable

    if arguments.page is not None and arguments.page.suffix != ".md":
        return fail(f"--page {arguments.page}: must be a Markdown file: give a name that ends in .md")
    try:
        # What is wrong is told before trackers run for hours.
        records.read_suites(arguments.repository)
        if arguments.page is not None:
            check_writable(arguments.page)
        _submit(arguments)
        print("Reading the clips; their difficulty is computed the first time, in about 4 s a clip.", file=sys.stderr)
        page = Page(records.read(arguments.repository, arguments.size, arguments.jobs), arguments.split)
        print(page.leaderboard())
        if arguments.page is not None:
            print(f"\nPage: {page.write(arguments.page, _command(arguments))}")
        verdicts = [page.verdict(tracker) for tracker in arguments.check]
    except ValueError as error:
        return fail(str(error))
    print("\n".join(verdict.text for verdict in verdicts))
    return 1 if any(verdict.flags for verdict in verdicts) else 0


def _submit(arguments: argparse.Namespace) -> None:
    """Keep the cards, and run trackers again."""
    from echotruth.benchmark.card import attach_card
    from echotruth.benchmark.rerun import rerun

    for card in arguments.card:
        print(f"Card: {attach_card(arguments.repository, card)}")
    for variant, trackers in (("mirrored", arguments.check), ("open", arguments.open)):
        for tracker in trackers:
            asked = arguments.repository, tracker, variant, arguments.split, arguments.size, arguments.jobs
            for line in rerun(*asked):
                print(line, flush=True)


def _command(arguments: argparse.Namespace) -> str:
    """Command line that makes the page."""
    words = [*map(str, arguments.repository), *(["--split", arguments.split] if arguments.split != "test" else [])]
    words += [word for size in arguments.size for word in ("--size", str(size))]
    return f"echotruth benchmark {shlex.join([*words, '--page', str(arguments.page)])}"

"""`echotruth run`: the repository and the report of a configuration."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.cli.command import add_configuration, fail
from echotruth.cli.snakemake import add_options, given, jobs_at_once, problem

if TYPE_CHECKING:
    from echotruth.cases import Case
    from echotruth.config import Config

REFUSED = 2
"""Exit status of Snakemake if it does not understand its command line."""
NO_HEART = 4
"""Exit status of a run that made everything, of which no heart is imaged."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth run`."""
    add_configuration(parser)
    parser.allow_abbrev = False  # what looks like the beginning of an option may be one of Snakemake
    parser.add_argument("--estimate", action="store_true", help="only print what it will take: jobs, time, disk")
    add_options(parser)
    parser.add_argument("--yes", action="store_true", help="run it even if its images make no sense")


def run(arguments: argparse.Namespace) -> int:
    """Make the repository and the report of a configuration.

    Run it again to continue what was interrupted. Options that are not listed here are passed to
    Snakemake.

    others that are useful here:
      repository --batch repository=1/4
             plan and make a quarter of a large sweep; then 2/4, 3/4, 4/4

    examples:
      echotruth run config/demo.yaml
      echotruth run config/sweep.yaml --estimate
      echotruth run config/sweep.yaml --cores 8

    exit status:
      0  everything is made
      1  the configuration is not valid, or jobs failed
      2  an option is wrong, the folder cannot be written, or the images make no sense; --yes runs the latter
         nevertheless
      4  everything is made, but no heart is complete: each failed or is implausible, and none is imaged
    """
    from echotruth.cli.configuration import load_cases
    from echotruth.workflow.concerns import concerns

    if wrong := problem(arguments):
        return fail(wrong)
    config, cases = load_cases(arguments.config)
    if arguments.estimate:
        from echotruth.workflow.cost import table

        hearts = len({case.heart for case in cases})
        print(f"{arguments.config}: hearts: {hearts}, cases: {len(cases)}, views of each: {len(config.views)}\n")
        print(table(config, hearts, len(cases), jobs_at_once(arguments)))
        return 0
    if arguments.dry_run:
        return subprocess.call(_command(arguments))
    found = list(concerns(config))
    print_concerns(found, arguments.yes)
    if any(concern.is_absurd for concern in found) and not arguments.yes:
        return 2
    try:
        return _make(arguments, config, cases)
    except KeyboardInterrupt:
        sys.exit("echotruth: interrupted; run the same command again to continue")


def print_concerns(found: list, is_accepted: bool = False) -> None:
    """Print what speaks against a run, a line each, less what the user accepts."""
    for concern in found:
        if not concern.is_absurd:
            print(f"echotruth: warning: {concern.text}", file=sys.stderr)
        elif not is_accepted:
            print(f"echotruth: {concern.text} (`echotruth run --yes` runs it all the same)", file=sys.stderr)


def _command(arguments: argparse.Namespace) -> list[str]:
    from echotruth.workflow.run import snakemake_command

    return snakemake_command(arguments.config, *given(arguments))


def _make(arguments: argparse.Namespace, config: Config, cases: list[Case]) -> int:
    """Make a repository and its report; return the exit status."""
    from echotruth.repository.status import imaged
    from echotruth.workflow import cost
    from echotruth.workflow.progress import Progress
    from echotruth.workflow.run import execute
    from echotruth.workflow.status import status_of, verdicts

    start, folder = time.time(), Path("out") / config.name
    progress = Progress({rule: cost.seconds(rule, config) for rule in cost.SECONDS})
    status = execute(_command(arguments), folder, progress)
    if status == REFUSED:
        return fail("Snakemake does not take these options: see echotruth run --help")
    if status:
        print(
            f"\nechotruth: not finished: run the same command again to go on (echotruth status {folder})",
            file=sys.stderr,
        )
        return status
    if not (folder / "report.html").is_file():  # only a part was asked for
        print(f"No report yet; what Snakemake said is in {folder / 'logs/snakemake.log'}")
        return 0
    found, spent = status_of(folder), sum(os.times()[2:4])
    print("\n".join(verdicts(found)))
    print(f"Time:       {cost.duration(time.time() - start)} ({cost.duration(spent)} of CPU time on this machine)")
    print(f"Repository: {folder / f'{folder.name}.zarr'}\nReport:     {folder / 'report.html'}")
    if any(found["verdicts"].get(name) for name in imaged(config.physiology.exclude_implausible)):
        return 0
    print("No heart is complete, so there are no images.")
    return NO_HEART

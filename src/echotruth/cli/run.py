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
from echotruth.cli.snakemake import executor_error, is_query, option_errors, split_targets, with_profiles

if TYPE_CHECKING:
    from echotruth.cases import Case
    from echotruth.config import Config

WRONG_OPTION = 2
"""Exit status of Snakemake, and of the command, if it does not take an option."""

WRITABLE = "the working folder must be writable and have space"


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth run`."""
    add_configuration(parser)
    parser.allow_abbrev = False  # what looks like the beginning of an option may be one of Snakemake
    text = "upload each result when it is finished; exit status 3 if all is made but not uploaded"
    parser.add_argument(
        "--estimate", action="store_true", help="only print what it will take: CPU time, GB, files, jobs"
    )
    parser.add_argument(
        "--yes", action="store_true", help="run it even if the estimate says that it does not fit or makes no sense"
    )
    text_of_block = "a larger sweep is planned by Snakemake in blocks of so many hearts (default: %(default)s)"
    parser.add_argument("--hearts-per-block", type=count, default=50, metavar="N", help=text_of_block)
    text_of_number = "blocks that are made side by side, each with --cores or --jobs of its own (default: %(default)s)"
    parser.add_argument("--blocks-at-once", type=count, default=1, metavar="N", help=text_of_number)
    parser.add_argument("--upload", metavar="s3://BUCKET/FOLDER", help=text)


def count(text: str) -> int:
    """Whole number above 0, as an option gives it."""
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number above 0")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    """Make the repository and the report of a configuration.

    Run it again to continue what was interrupted. Options that are not listed here are passed to
    Snakemake.

    options of Snakemake that are useful here:
      --cores N             number of processor cores (default: all)
      -n                    only list the jobs
      --profile NAME        where jobs run: default, slurm, or a folder with a config.yaml of Snakemake
      --rerun-triggers mtime  do not make again what other settings or code would change

    examples:
      echotruth run config/demo.yaml
      echotruth run config/sweep.yaml --estimate
      echotruth run config/sweep.yaml --cores 8
      echotruth run config/demo.yaml --upload s3://bucket/demo

    exit status:
      0  everything is made
      1  the configuration is not valid, or jobs failed
      2  an option is wrong, or it does not fit this machine or makes no sense; --yes runs the latter nevertheless
      3  everything is made, but not everything is uploaded
      4  everything is made, but no heart is complete: each failed or is implausible, and none is imaged
    """
    from echotruth.cli.configuration import load_cases

    if errors := option_errors(arguments.options):
        return fail("\n".join(errors))
    config, cases = load_cases(arguments.config)
    expected: dict[str, float] = {}
    try:
        if arguments.estimate or not any(map(is_query, arguments.options)):
            from echotruth.cli.estimation import estimated, print_concerns

            found, concerns = estimated(config, cases, arguments.options)
            expected = {rule: part.seconds for rule, part in found.parts.items()}
            is_absurd = any(concern.is_absurd for concern in concerns)
            if arguments.estimate:
                from echotruth.workflow.estimate import table

                print(f"{arguments.config}: hearts: {len(cases)}, views of each: {len(config.views)}\n")
                print(table(found, Path("out") / config.name))
            print_concerns(concerns, arguments.yes)
            if is_absurd and not arguments.yes:
                return 2
            if arguments.estimate:
                return 0
        return _started(arguments, config, cases, expected)
    except KeyboardInterrupt:
        sys.exit("echotruth: interrupted; run the same command again to continue")
    except OSError as error:
        sys.exit(f"echotruth: {error.filename or arguments.config}: {error.strerror or error}: {WRITABLE}")


def _started(arguments: argparse.Namespace, config: Config, cases: list[Case], expected: dict[str, float]) -> int:
    """Make a repository, unless the package that starts jobs elsewhere is missing; return the exit status."""
    from echotruth.cli.estimation import profile_content
    from echotruth.workflow.snakemake_process import snakemake_command

    if error := executor_error((profile_content(arguments.options) or {}).get("executor")):
        return fail(error)
    if any(map(is_query, arguments.options)):
        return subprocess.call(snakemake_command(arguments.config, with_profiles(arguments.options)))
    return make_repository(arguments, config, cases, expected)


def make_repository(
    arguments: argparse.Namespace, config: Config, cases: list[Case], expected: dict[str, float]
) -> int:
    """Run the workflow of a configuration and write its report; return the exit status of Snakemake.

    If all jobs went well, the status is :data:`echotruth.workflow.summary.NO_HEART` if no heart is complete, and
    :data:`echotruth.workflow.uploading.NOT_UPLOADED` if not everything is uploaded.

    Parameters
    ----------
    arguments : Namespace
        Options for Snakemake, such as `--cores 4`; the address in object storage to which everything is uploaded, or
        None; hearts in a block, and blocks at once.
    config : Config
    cases : list of Case
        Its hearts.
    expected : dict
        Rule -> expected duration of one of its jobs, s.
    """
    from echotruth.workflow import lease

    folder, url = Path("out") / config.name, arguments.upload
    if url is None:
        with lease.held(folder) as name:
            return _make(arguments, config, cases, os.environ | {lease.VARIABLE: name}, expected)
    from echotruth.repository.remote import Remote, RemoteError
    from echotruth.workflow.uploading import uploading

    try:
        remote = Remote(url)
    except RemoteError as error:
        return fail(str(error))
    with lease.held(folder) as name, uploading(folder, remote) as upload:
        status = _make(arguments, config, cases, os.environ | {lease.VARIABLE: name}, expected)
        not_uploaded = upload.finish()
    return status or not_uploaded


def _make(
    arguments: argparse.Namespace,
    config: Config,
    cases: list[Case],
    environment: dict[str, str],
    expected: dict[str, float],
) -> int:
    """Make a repository and its report; return the exit status."""
    from echotruth.mechanics.geometry import GeometryError
    from echotruth.mechanics.prescribed import MotionError
    from echotruth.repository.layout import lay_out
    from echotruth.workflow.progress import Progress
    from echotruth.workflow.running import Running
    from echotruth.workflow.snakemake_process import execute, snakemake_command
    from echotruth.workflow.summary import finished, unfinished

    start, folder = time.time(), Path("out") / config.name
    try:
        lay_out(folder, config, cases)
    except (GeometryError, MotionError) as error:
        return fail(f"{arguments.config}: {error}")
    # The copy in the repository: the file may change while jobs wait in a queue.
    options, targets = split_targets(arguments.options)
    command = snakemake_command(folder / "config.yaml", with_profiles(options))
    running = Running(folder, config, command, targets, arguments.hearts_per_block)
    progress = Progress(expected, running.waiting())
    status = execute(running.hearts(), config.name, progress, environment, arguments.blocks_at_once)
    if not status:
        status = execute(running.end(), config.name, progress, environment)
    if status == WRONG_OPTION:
        print("\nechotruth: Snakemake does not take these options: see echotruth run --help", file=sys.stderr)
    elif status:
        print(f"\nechotruth: {unfinished(folder)}", file=sys.stderr)
    elif (folder / "report.html").is_file():
        lines, status = finished(folder, start, config.physiology.exclude_implausible)
        print(lines)
    return status

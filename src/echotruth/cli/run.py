"""`echotruth run`: the repository and the report of a configuration."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.cli.command import Commands, add_command, add_configuration, fail
from echotruth.cli.snakemake import PROFILES, WORKFLOW, executor_error, is_query, option_errors, with_profiles

if TYPE_CHECKING:
    from echotruth.config import Config

NOTES = f"""options of Snakemake that are useful here:
  --cores N             number of processor cores (default: all)
  -n                    only list the jobs
  --profile NAME        where jobs run: {", ".join(PROFILES)}, or a folder with a profile (docs/cluster.md)
  --batch repository=1/10  only the first tenth of the hearts, then 2/10 and so on: plans a large sweep in pieces
  --rerun-triggers mtime  do not make again what other settings or code would change
"""

STATUSES = {
    0: "everything is made",
    1: "the configuration is not valid, or jobs failed",
    2: "an option is wrong, or it does not fit this machine or makes no sense; --yes runs the latter nevertheless",
    3: "everything is made, but not everything is uploaded",
    4: "everything is made, but no heart is complete: each failed or is implausible, and none is imaged",
}

WRONG_OPTION = 2
"""Exit status of Snakemake, and of the command, if it does not take an option."""

WRITABLE = "the working folder must be writable and have space"


def add(commands: Commands) -> None:
    """Add the parser of `echotruth run`."""
    parser = add_command(
        commands,
        run,
        "make the repository and the report of a configuration",
        "Run it again to continue what was interrupted. Options that are not listed here are passed to Snakemake.",
        [
            "run config/demo.yaml",
            "run config/sweep.yaml --estimate",
            "run config/sweep.yaml --cores 8",
            "run config/demo.yaml --upload s3://bucket/demo",
        ],
        STATUSES,
        NOTES,
    )
    add_configuration(parser)
    parser.allow_abbrev = False  # what looks like the beginning of an option may be one of Snakemake
    text = "upload each result when it is finished (docs/storage.md); exit status 3 if all is made but not uploaded"
    parser.add_argument(
        "--estimate", action="store_true", help="only print what it will take: CPU time, GB, files, jobs"
    )
    parser.add_argument(
        "--yes", action="store_true", help="run it even if the estimate says that it does not fit or makes no sense"
    )
    parser.add_argument("--upload", metavar="s3://BUCKET/FOLDER", help=text)


def run(arguments: argparse.Namespace) -> int:
    """Run the workflow of a configuration; return the exit status."""
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
        return _started(arguments, config, expected)
    except KeyboardInterrupt:
        sys.exit("echotruth: interrupted; run the same command again to continue")
    except OSError as error:
        sys.exit(f"echotruth: {error.filename or arguments.config}: {error.strerror or error}: {WRITABLE}")


def _started(arguments: argparse.Namespace, config: Config, expected: dict[str, float]) -> int:
    """Make a repository, unless the package that starts jobs elsewhere is missing; return the exit status."""
    from echotruth.cli.estimation import profile_content

    if error := executor_error((profile_content(arguments.options) or {}).get("executor")):
        return fail(error)
    return make_repository(arguments.config, config, arguments.options, arguments.upload, expected)


def make_repository(
    path: str,
    config: Config,
    options: list[str],
    url: str | None,
    expected: dict[str, float],
) -> int:
    """Run the workflow of a configuration and write its report; return the exit status of Snakemake.

    If all jobs went well, the status is :data:`echotruth.workflow.summary.NO_HEART` if no heart is complete, and
    :data:`echotruth.workflow.uploading.NOT_UPLOADED` if not everything is uploaded.

    Parameters
    ----------
    path : str
        Path of the configuration file.
    config : Config
        The configuration in that file.
    options : list of str
        Options for Snakemake, such as `--cores 4` or `-n`.
    url : str or None
        Address in object storage to which everything is uploaded when it is committed.
    expected : dict
        Rule -> expected duration of one of its jobs, s.
    """
    from echotruth.workflow import lease

    folder = Path("out") / config.name
    # Snakemake's own lock is that of the working folder, where other names may run; a repository has its lease.
    # Not at the end: --configfile takes all that follows, files to make too.
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(WORKFLOW / "Snakefile")]
    command += ["--configfile", path, "--nolock", *with_profiles(options)]
    if any(map(is_query, options)):
        return subprocess.call(command)
    if url is None:
        with lease.held(folder) as name:
            return _make(folder, config, command, os.environ | {lease.VARIABLE: name}, expected)
    from echotruth.repository.remote import Remote, RemoteError
    from echotruth.workflow.uploading import uploading

    try:
        remote = Remote(url)
    except RemoteError as error:
        return fail(str(error))
    with lease.held(folder) as name, uploading(folder, remote) as upload:
        status = _make(folder, config, command, os.environ | {lease.VARIABLE: name}, expected)
        not_uploaded = upload.finish()
    return status or not_uploaded


def _make(
    folder: Path, config: Config, command: list[str], environment: dict[str, str], expected: dict[str, float]
) -> int:
    """Make a repository and its report; return the exit status."""
    from echotruth.workflow.execution import Snakemake, execute
    from echotruth.workflow.progress import Progress
    from echotruth.workflow.summary import finished, unfinished

    start, log = time.time(), folder / "logs/snakemake.log"
    if status := _remake(folder, config, command, environment):
        return status
    status = execute([Snakemake(command, log)], config.name, Progress(expected), environment)
    if status == WRONG_OPTION:
        print("\nechotruth: Snakemake does not take these options: see echotruth run --help", file=sys.stderr)
    elif status:
        print(f"\nechotruth: {unfinished(folder)}", file=sys.stderr)
    elif (folder / "report.html").is_file():
        lines, status = finished(folder, start, config.physiology.exclude_implausible)
        print(lines)
    return status


def _remake(folder: Path, config: Config, command: list[str], environment: dict[str, str]) -> int:
    """Make what `echotruth check --heal` dropped, and nothing that depends on it; return the exit status."""
    if not (folder / "healing.json").is_file():
        return 0
    from echotruth.repository.healing import remake
    from echotruth.workflow.execution import Snakemake, execute
    from echotruth.workflow.progress import Progress
    from echotruth.workflow.series import ALONE

    def make(paths: list[str]) -> int:
        stage = Path(paths[0]).relative_to(folder / "ledger").parts[0].removesuffix(".json")
        run = Snakemake([*command, *paths], folder / f"logs/healing_{stage}.log")
        return execute([run], config.name, Progress({}), environment | {ALONE: "1"})

    return remake(folder, config, make)

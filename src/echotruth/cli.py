"""Command line: `echotruth check`, `cases`, `run`, `validate`, `export` and `evaluate`."""

from __future__ import annotations

import argparse
import fcntl
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import echotruth
from echotruth.cases import expand, table
from echotruth.config import Config
from echotruth.config.loading import ConfigError, load


def main() -> None:
    """Entry point of the command `echotruth`."""
    arguments, options = _parser().parse_known_args()
    if options and arguments.command != "run":
        sys.exit(f"echotruth {arguments.command}: unknown option {options[0]}: see echotruth --help")
    if command := {"validate": validate, "export": export, "evaluate": evaluate}.get(arguments.command):
        sys.exit(command(arguments))
    try:
        config = load(arguments.config)
        cases = expand(config, arguments.config)
    except ConfigError as error:
        sys.exit(f"echotruth: {error}")
    if arguments.command == "check":
        print(f"{arguments.config}: valid; cases: {len(cases)}, views per case: {len(config.views)}")
    elif arguments.command == "cases":
        table(cases).to_csv(sys.stdout, index=False)
    else:
        try:
            sys.exit(run(arguments.config, config, options))
        except KeyboardInterrupt:
            sys.exit("echotruth: interrupted; run the same command again to continue")


def run(path: str, config: Config, options: list[str]) -> int:
    """Run the workflow of a configuration and write its report; return the exit status of Snakemake.

    Parameters
    ----------
    path : str
        Path of the configuration file.
    config : Config
        The configuration in that file.
    options : list of str
        Options for Snakemake, such as `--cores 4` or `-n`.
    """
    from echotruth.workflow.execution import execute
    from echotruth.workflow.progress import measured_seconds

    folder = Path("out") / config.name
    snakemake = [sys.executable, "-m", "snakemake", "--snakefile", str(WORKFLOW / "Snakefile"), "--configfile", path]
    options = [str(WORKFLOW / "profiles" / option) if option in PROFILES else option for option in options]
    with _locked(folder):
        # A killed run leaves Snakemake's lock behind. Our lock ends with its process, so no other run is active.
        if any(Path(".snakemake/locks").glob("*")):
            _run_quietly([*snakemake, "--unlock"])
        if any(map(_is_query, options)):
            return subprocess.call([*snakemake, *options])
        report = ["--report", str(folder / "report.html")]
        # If everything is made, Snakemake writes the report in the same process, which saves a second start.
        makes_all = not [option for option in options if option not in CORE_OPTIONS and not option.isdigit()]
        command = [*snakemake, *options, *(["--report-after-run", *report] if makes_all else [])]
        status = execute(command, folder / "logs/snakemake.log", config.name, measured_seconds(folder / "ledger"))
        if status or not (folder / "figures/leaderboard.csv").is_file():
            return status
        status = 0 if makes_all else _run_quietly([*snakemake, *report])
    if status == 0:
        print(f"\nRepository: {folder / f'{config.name}.zarr'}\nReport:     {folder / 'report.html'}")
    return status


WORKFLOW = Path(echotruth.__file__).parent / "workflow"
"""Folder of the Snakefile, which travels with the package."""

PROFILES = tuple(path.name for path in (WORKFLOW / "profiles").iterdir())
"""Profiles of the package, which `--profile` takes by their name."""

CORE_OPTIONS = ("--cores", "-c", "--jobs", "-j", "all")
"""Options (and values) that do not restrict what Snakemake makes."""

QUERY_OPTIONS = {
    *("--dry-run", "--dryrun", "--dag", "--rulegraph", "--filegraph", "--d3dag", "--summary", "--detailed-summary"),
    *("--lint", "--list", "--list-rules", "--list-target-rules", "--help", "-h", "-l", "-S", "-D"),
}
"""Options with which Snakemake only prints; combined short options with an n, such as -np, are others."""


def _is_query(option: str) -> bool:
    return option in QUERY_OPTIONS or re.fullmatch(r"-[a-z]*n[a-z]*", option) is not None


def validate(arguments: argparse.Namespace) -> int:
    """Validate the mechanics and write the page of results; return 1 if a check fails, otherwise 0."""
    if not Path("validation/page.py").is_file():
        return _fail("no folder validation in this folder: run this in a checkout of echotruth")
    sys.path.insert(0, str(Path.cwd()))
    from validation.page import write

    folder = Path(arguments.folder)
    passed = write(folder, arguments.quick, lambda line: print(line, flush=True))
    print(f"\nPage: {folder / 'validation.md'}")
    return 0 if passed else 1


def export(arguments: argparse.Namespace) -> int:
    """Write the RF of one case and view as a USTB or zea file; return 0, or 2 if it cannot be exported."""
    from echotruth.repository.export import ExportError
    from echotruth.repository.export import export as write

    try:
        file = write(arguments.repository, arguments.format, arguments.case, arguments.view, arguments.out)
    except ExportError as error:
        return _fail(str(error))
    print(file)
    return 0


def evaluate(arguments: argparse.Namespace) -> int:
    """Evaluate a tracker on a repository; return 0, 1 if it failed on every clip, or 2 if it cannot be evaluated."""
    from echotruth.evaluation.run import format_row, prepare, summary
    from echotruth.evaluation.tracker_options import EvaluationError, parse_tracker

    rows = []
    try:
        name, settings = parse_tracker(arguments.tracker, arguments.program, arguments.option, arguments.timeout)
        evaluation = prepare(arguments.repository, arguments.name or name, settings)
        case_views, sizes = evaluation.case_views(arguments.case, arguments.view), evaluation.sizes(arguments.size)
        evaluation.check_writable()
        for row in evaluation.rows(case_views, sizes, arguments.jobs):
            print(format_row(row), flush=True)
            rows.append(row)
        table = evaluation.write(rows)
    except (EvaluationError, ConfigError) as error:
        return _fail(str(error))
    print(f"\n{summary(table)}\n\nScores: {evaluation.file}")
    return 0 if any(not row["failure"] for row in rows) else 1


def _run_quietly(command: list[str]) -> int:
    """Run a command and show its output only if it fails."""
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if result.returncode:
        print(result.stdout, file=sys.stderr)
    return result.returncode


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold a file lock on the folder of a repository; wait for another process that holds it."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            print(f"echotruth: another run is using {folder}; waiting until it ends", file=sys.stderr)
            fcntl.flock(lock, fcntl.LOCK_EX)
        os.set_inheritable(lock.fileno(), True)
        yield


def _fail(message: str) -> int:
    print(f"echotruth: {message}", file=sys.stderr)
    return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="echotruth", description=(echotruth.__doc__ or "").split("\n")[0])
    parser.add_argument("--version", action="version", version=echotruth.__version__)
    commands = parser.add_subparsers(dest="command", required=True)
    for name, text in (
        ("check", "check a configuration"),
        ("cases", "print the cases of a configuration as CSV"),
        ("run", "make the repository and the report of a configuration; other options are passed to Snakemake"),
    ):
        command = commands.add_parser(name, help=text, description=text)
        command.add_argument("config", help="YAML file, such as config/demo.yaml")
    text = "compare the heart with exact solutions, published problems and conservation laws, and write the page"
    command = commands.add_parser("validate", help=text, description=text)
    command.add_argument("--quick", action="store_true", help="use coarse meshes; takes a few minutes")
    command.add_argument("--folder", default="docs", help="folder for validation.md (default: docs)")
    text = "write the RF of a repository as a file for USTB (uff) or zea"
    command = commands.add_parser("export", help=text, description=text)
    command.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    command.add_argument("--format", choices=("uff", "zea"), required=True, help="file format (both are HDF5)")
    command.add_argument("--case", required=True, help="case id from cases.csv")
    command.add_argument("--view", required=True, help="name of the view")
    command.add_argument("--out", type=Path, help="file to write (default: CASE_VIEW in the folder export)")
    _add_evaluate(commands)
    return parser


def _add_evaluate(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "run a tracker on every clip of a repository, score it like the repository's own trackers, write the scores"
    command = commands.add_parser("evaluate", help=text, description=text)
    command.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    tracker = command.add_mutually_exclusive_group(required=True)
    tracker.add_argument("--tracker", help="package.module:function, an entry point, or a method of config/README.md")
    # `arguments.command` is the name of the subcommand.
    tracker.add_argument("--command", dest="program", help='a program, such as "track {input} {output}"')
    command.add_argument("--timeout", type=float, help="longest time of the program per clip, s (default: 3600)")
    command.add_argument("--name", help="name of the tracker in the scores (default: derived from the tracker)")
    for option, kind, text in (
        ("option", str, "key=value for the tracker; can be repeated"),
        ("case", str, "case id from cases.csv; can be repeated (default: all)"),
        ("view", str, "name of the view; can be repeated (default: all)"),
        ("size", int, "image size, px; can be repeated (default: all)"),
    ):
        command.add_argument(f"--{option}", type=kind, action="append", default=[], help=text)
    command.add_argument("--jobs", type=int, default=1, help="processes (default: 1); scores do not depend on it")

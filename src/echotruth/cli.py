"""The command line: `echotruth check`, `cases`, `run`, `validate`, `export` and `evaluate`."""

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
        sys.exit(f"echotruth {arguments.command}: {options[0]} is not an option: see echotruth --help")
    if command := {"validate": validate, "export": export, "evaluate": evaluate}.get(arguments.command):
        sys.exit(command(arguments))
    try:
        config = load(arguments.config)
        cases = expand(config, arguments.config)
    except ConfigError as error:
        sys.exit(f"echotruth: {error}")
    if arguments.command == "check":
        print(f"{arguments.config}: fine, {len(cases)} cases of {len(config.views)} views each")
    elif arguments.command == "cases":
        table(cases).to_csv(sys.stdout, index=False)
    else:
        try:
            sys.exit(run(arguments.config, config, options))
        except KeyboardInterrupt:
            sys.exit("echotruth: interrupted; run it again and it goes on where it was")


def run(path: str, config: Config, options: list[str]) -> int:
    """Run the workflow of a configuration, then write its report; the exit status of Snakemake.

    Parameters
    ----------
    path : str
        The configuration's file.
    config : Config
        What it says.
    options : list of str
        Handed on to Snakemake, as `--cores 4` or `-n`.
    """
    if not Path("Snakefile").is_file():
        return _complain("no Snakefile here: run this in a checkout of echotruth")
    from echotruth.workflow.execution import execute
    from echotruth.workflow.progress import measured

    folder = Path("out") / config.name
    snakemake = [sys.executable, "-m", "snakemake", "--configfile", path]
    with _alone(folder):
        # A killed run leaves Snakemake's own lock behind; ours dies with its process, so nobody is at work here.
        if any(Path(".snakemake/locks").glob("*")):
            _quietly([*snakemake, "--unlock"])
        if any(map(_only_tells, options)):
            return subprocess.call([*snakemake, *options])
        report = ["--report", str(folder / "report.html")]
        # One start of Snakemake does for all, where all is made.
        at_once = not [option for option in options if option not in CORES and not option.isdigit()]
        command = [*snakemake, *options, *(["--report-after-run", *report] if at_once else [])]
        status = execute(command, folder / "logs/snakemake.log", config.name, measured(folder / "ledger"))
        if status or not (folder / "figures/leaderboard.csv").is_file():
            return status
        status = 0 if at_once else _quietly([*snakemake, *report])
    if status == 0:
        print(f"\nRepository: {folder / f'{config.name}.zarr'}\nReport:     {folder / 'report.html'}")
    return status


CORES = ("--cores", "-c", "--jobs", "-j", "all")
"""Options, and what may stand beside them, that leave open what is made: everything."""

TELLS = {
    *("--dry-run", "--dryrun", "--dag", "--rulegraph", "--filegraph", "--d3dag", "--summary", "--detailed-summary"),
    *("--lint", "--list", "--list-rules", "--list-target-rules", "--help", "-h", "-l", "-S", "-D"),
}
"""Options with which Snakemake tells something and makes nothing; so does it with an n among short ones, as -np."""


def _only_tells(option: str) -> bool:
    return option in TELLS or re.fullmatch(r"-[a-z]*n[a-z]*", option) is not None


def validate(arguments: argparse.Namespace) -> int:
    """Check the heart against what is known and write the page; 1 if a number is off, otherwise 0."""
    if not Path("validation/page.py").is_file():
        return _complain("no folder validation here: run this in a checkout of echotruth")
    sys.path.insert(0, str(Path.cwd()))
    from validation.page import write

    folder = Path(arguments.folder)
    met = write(folder, arguments.quick, lambda said: print(said, flush=True))
    print(f"\nPage: {folder / 'validation.md'}")
    return 0 if met else 1


def export(arguments: argparse.Namespace) -> int:
    """Write the RF of one case and view in the file format of others; 0, or 2 where there is none."""
    from echotruth.repository.export import CannotExport
    from echotruth.repository.export import export as write

    try:
        file = write(arguments.repository, arguments.format, arguments.case, arguments.view, arguments.out)
    except CannotExport as error:
        return _complain(str(error))
    print(file)
    return 0


def evaluate(arguments: argparse.Namespace) -> int:
    """Try a tracker on a repository; 0, or 1 if it failed on every clip, or 2 where it cannot be tried."""
    from echotruth.evaluation import run as trial
    from echotruth.evaluation.tracker_options import CannotTry, entrant

    rows = []
    try:
        name, settings = entrant(arguments.tracker, arguments.program, arguments.option, arguments.timeout)
        tried = trial.trial(arguments.repository, arguments.name or name, settings)
        places, sizes = tried.places(arguments.case, arguments.view), tried.sizes(arguments.size)
        tried.make_room()
        for row in tried.rows(places, sizes, arguments.jobs):
            print(trial.told(row), flush=True)
            rows.append(row)
        table = tried.write(rows)
    except (CannotTry, ConfigError) as error:
        return _complain(str(error))
    print(f"\n{trial.summary(table)}\n\nScores: {tried.file}")
    return 0 if any(not row["failure"] for row in rows) else 1


def _quietly(command: list[str]) -> int:
    """Run a command whose words matter only when it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode:
        print(done.stdout, file=sys.stderr)
    return done.returncode


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Hold a lock of the kernel on a repository's folder; wait for whoever holds it."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            print(f"echotruth: another run is at work in {folder}; waiting for it to end", file=sys.stderr)
            fcntl.flock(lock, fcntl.LOCK_EX)
        os.set_inheritable(lock.fileno(), True)
        yield


def _complain(sentence: str) -> int:
    print(f"echotruth: {sentence}", file=sys.stderr)
    return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="echotruth", description=echotruth.__doc__)
    parser.add_argument("--version", action="version", version=echotruth.__version__)
    commands = parser.add_subparsers(dest="command", required=True)
    for name, text in (
        ("check", "check a configuration"),
        ("cases", "print the cases of a configuration as CSV"),
        ("run", "make the repository and the report of a configuration; further options go to Snakemake"),
    ):
        command = commands.add_parser(name, help=text, description=text)
        command.add_argument("config", help="YAML file, as config/demo.yaml")
    text = "check the heart against exact solutions, published problems and conservation laws, and write the page"
    command = commands.add_parser("validate", help=text, description=text)
    command.add_argument("--quick", action="store_true", help="coarse meshes, a few minutes")
    command.add_argument("--folder", default="docs", help="where validation.md is written (default: docs)")
    text = "write the RF that a repository keeps as a file of USTB (uff) or zea"
    command = commands.add_parser("export", help=text, description=text)
    command.add_argument("repository", type=Path, help="folder of the repository, as out/demo")
    command.add_argument("--format", choices=("uff", "zea"), required=True, help="of the file, both HDF5")
    command.add_argument("--case", required=True, help="case id, as in cases.csv")
    command.add_argument("--view", required=True, help="name of the view")
    command.add_argument("--out", type=Path, help="file to write (default: CASE_VIEW in the folder export)")
    _add_evaluate(commands)
    return parser


def _add_evaluate(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "try a tracker on every clip of a repository, score it as the repository's own and write the scores"
    command = commands.add_parser("evaluate", help=text, description=text)
    command.add_argument("repository", type=Path, help="folder of the repository, as out/demo")
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--tracker", help="package.module:function, an entry point, or a method of config/README.md")
    # `command` is taken by the name of the command itself.
    which.add_argument("--command", dest="program", help='a program, as "track {input} {output}"')
    command.add_argument("--timeout", type=float, help="longest time a program may take over a clip, s (default: 3600)")
    command.add_argument("--name", help="under which the scores stand (default: made of the tracker's)")
    for option, kind, text in (
        ("option", str, "key=value for the tracker; may be given again, as those below"),
        ("case", str, "case id, as in cases.csv (default: all)"),
        ("view", str, "name of the view (default: all)"),
        ("size", int, "image size, px (default: all)"),
    ):
        command.add_argument(f"--{option}", type=kind, action="append", default=[], help=text)
    command.add_argument("--jobs", type=int, default=1, help="processes; the scores do not depend on it (default: 1)")

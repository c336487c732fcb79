"""Command line: `echotruth check`, `cases`, `run`, `merge`, `validate`, `export`, `describe`, `upload` and
`evaluate`.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
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
    if command := _command(arguments):
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
            sys.exit(run(arguments.config, config, options, arguments.upload))
        except KeyboardInterrupt:
            sys.exit("echotruth: interrupted; run the same command again to continue")
        except OSError as error:
            sys.exit(f"echotruth: {error.filename or arguments.config}: {error.strerror or error}: {WRITABLE}")


def _command(arguments: argparse.Namespace) -> Callable[[argparse.Namespace], int] | None:
    """Function of a command that does not start from a configuration."""
    if arguments.command == "check":
        return check if arguments.heal or Path(arguments.config).is_dir() else None
    commands = {"validate": validate, "export": export, "describe": describe, "evaluate": evaluate, "merge": merge}
    return (commands | {"upload": upload}).get(arguments.command)


def run(path: str, config: Config, options: list[str], url: str | None = None) -> int:
    """Run the workflow of a configuration and write its report; return the exit status of Snakemake.

    If all went well but the upload, the status is :data:`echotruth.workflow.uploading.NOT_UPLOADED`.

    Parameters
    ----------
    path : str
        Path of the configuration file.
    config : Config
        The configuration in that file.
    options : list of str
        Options for Snakemake, such as `--cores 4` or `-n`.
    url : str, optional
        Address in object storage to which everything is uploaded when it is committed.
    """
    from echotruth.workflow import lease

    folder = Path("out") / config.name
    # Snakemake's own lock is that of the working folder, where other names may run; a repository has its lease.
    snakemake = [sys.executable, "-m", "snakemake", "--snakefile", str(WORKFLOW / "Snakefile"), "--nolock"]
    snakemake += ["--configfile", path]
    options = with_profiles(options)
    if any(map(_is_query, options)):
        return subprocess.call([*snakemake, *options])
    if url is None:
        with lease.held(folder) as name:
            return _make(folder, config, snakemake, options, os.environ | {lease.VARIABLE: name})
    from echotruth.repository.remote import Remote, RemoteError
    from echotruth.workflow.uploading import uploading

    try:
        remote = Remote(url)
    except RemoteError as error:
        return _fail(str(error))
    with lease.held(folder) as name, uploading(folder, remote) as upload:
        status = _make(folder, config, snakemake, options, os.environ | {lease.VARIABLE: name})
        not_uploaded = upload.finish()
    return status or not_uploaded


def _make(folder: Path, config: Config, snakemake: list[str], options: list[str], environment: dict[str, str]) -> int:
    """Make a repository and its report; return the exit status."""
    from echotruth.workflow.execution import execute
    from echotruth.workflow.progress import measured_seconds

    report = ["--report", str(folder / "report.html")]
    # If everything is made, Snakemake writes the report in the same process, which saves a second start.
    makes_all = not [option for option in options if option not in CORE_OPTIONS and not option.isdigit()]
    command = [*snakemake, *options, *(["--report-after-run", *report] if makes_all else [])]
    log, expected = folder / "logs/snakemake.log", measured_seconds(folder / "ledger")
    if status := _remake(folder, config, [*snakemake, *options], environment):
        return status
    status = execute(command, log, config.name, expected, environment)
    if status or not (folder / "figures/leaderboard.csv").is_file():
        return status
    status = 0 if makes_all else _run_quietly([*snakemake, *report], environment)
    if status == 0:
        print(f"\nRepository: {folder / f'{config.name}.zarr'}\nReport:     {folder / 'report.html'}")
    return status


def _remake(folder: Path, config: Config, command: list[str], environment: dict[str, str]) -> int:
    """Make what `echotruth check --heal` dropped, and nothing that depends on it; return the exit status."""
    if not (folder / "healing.json").is_file():
        return 0
    from echotruth.repository.healing import remake
    from echotruth.workflow.execution import execute
    from echotruth.workflow.series import ALONE

    def make(paths: list[str]) -> int:
        stage = Path(paths[0]).relative_to(folder / "ledger").parts[0].removesuffix(".json")
        log = folder / f"logs/healing_{stage}.log"
        return execute([*command, *paths], log, config.name, {}, environment | {ALONE: "1"})

    return remake(folder, config, make)


WRITABLE = "the working folder must be writable and have space"

WORKFLOW = Path(echotruth.__file__).parent / "workflow"
"""Folder of the Snakefile, which travels with the package."""

PROFILES = sorted(path.name for path in (WORKFLOW / "profiles").iterdir())
"""Profiles of the package, which `--profile` takes by their name."""

PROFILE_OPTIONS = ("--profile", "--workflow-profile")


def with_profiles(options: list[str]) -> list[str]:
    """Options for Snakemake in which the name of a profile of the package is replaced by its folder.

    Such a profile takes the place of the package's default one, so that a profile of the user can be given beside it.
    """
    joined = tuple(f"{flag}=" for flag in PROFILE_OPTIONS)
    options = [part for option in options for part in (option.split("=", 1) if option.startswith(joined) else [option])]
    for place, (flag, name) in enumerate(pairwise(tuple(options))):
        if flag in PROFILE_OPTIONS and name in PROFILES and not Path(name).is_dir():
            options[place : place + 2] = ["--workflow-profile", str(WORKFLOW / "profiles" / name)]
    return options


RUN_OPTIONS = f"""options of Snakemake that are useful here:
  --cores N             number of processor cores (default: all)
  -n                    only list the jobs
  --profile NAME        where jobs run: {", ".join(PROFILES)}, or a folder with a profile (docs/cluster.md)
  --batch repository=1/10  only the first tenth of the hearts, then 2/10 and so on: plans a large sweep in pieces
  --rerun-triggers mtime  do not make again what other settings or code would change
"""

UPLOAD = "upload all that is committed (docs/storage.md); exit status 3 if all but that went well"

CORE_OPTIONS = ("--cores", "-c", "--jobs", "-j", "all")
"""Options (and values) that do not restrict what Snakemake makes."""

QUERY_OPTIONS = {
    *("--dry-run", "--dryrun", "--dag", "--rulegraph", "--filegraph", "--d3dag", "--summary", "--detailed-summary"),
    *("--lint", "--list", "--list-rules", "--list-target-rules", "--help", "-h", "-l", "-S", "-D"),
}
"""Options with which Snakemake only prints; combined short options with an n, such as -np, are others."""


def _is_query(option: str) -> bool:
    return option in QUERY_OPTIONS or re.fullmatch(r"-[a-z]*n[a-z]*", option) is not None


def check(arguments: argparse.Namespace) -> int:
    """Check a repository; return 0, 1 if something is damaged, or 2 if it cannot be checked."""
    from echotruth.workflow.integrity import check_repository

    return check_repository(Path(arguments.config), arguments.heal, arguments.quick)


def merge(arguments: argparse.Namespace) -> int:
    """Take over the hearts of repositories into another; return 0, or 2 if they cannot be merged."""
    from echotruth.workflow.merging import merge_repositories

    return merge_repositories(arguments.into, arguments.sources)


def upload(arguments: argparse.Namespace) -> int:
    """Upload a repository; return 0, 1 if something is damaged, or 2 if it cannot be uploaded."""
    from echotruth.workflow.uploading import upload_repository

    return upload_repository(arguments.repository, arguments.url, arguments.verify)


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
    """Write clips, hearts or RF as files of another format; return 0, or 2 if they cannot be exported."""
    from echotruth.export import Export, ExportError, Selection, source

    chosen = Selection(arguments.case, arguments.view, arguments.size, arguments.tracker)
    try:
        opened = source(arguments.repository, chosen)
        work = Export(opened, arguments.format, arguments.overlay, arguments.rate, arguments.output)
        clips, left_out = work.clips()
        _print_counted(work.write(clips), len(clips))
    except (ExportError, ConfigError) as error:
        return _fail(str(error))
    except OSError as error:
        place, said = error.filename or arguments.output or arguments.repository, error.strerror or str(error)
        return _fail(f"{place}: {' '.join(said.split())}: the folder for the files must be writable and have space")
    except KeyboardInterrupt:
        return _fail("interrupted; the files that were named are whole")
    if left_out:
        print(f"echotruth: left out {len(left_out)} that are not finished, first: {left_out[0]}", file=sys.stderr)
    return 0


def _print_counted(paths: Iterator[Path], total: int) -> None:
    """Print each path when its file is written; below them, where a person watches, how many of many there are."""
    watched = sys.stderr.isatty() and total > 1

    def show(line: str) -> None:
        if watched:
            print(f"\r\033[K{line}", end="", file=sys.stderr, flush=True)

    try:
        show(f"0 of {total}")
        for done, path in enumerate(paths, start=1):
            show("")
            print(path, flush=True)
            show(f"{done} of {total}")
    finally:
        show("")


def describe(arguments: argparse.Namespace) -> int:
    """Write the documents that describe a repository; return 0, or 2 if it cannot be described."""
    from echotruth.repository.description import DescriptionError, attribution
    from echotruth.repository.description import describe as write
    from echotruth.workflow import lease

    try:
        given = attribution(arguments.author, arguments.license, arguments.url, arguments.release, arguments.date)
        lease.follow(arguments.repository)
        documents = write(arguments.repository, arguments.output, given)
    except (DescriptionError, lease.LeaseError) as error:
        return _fail(str(error))
    for path in documents:
        print(path)
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


def _run_quietly(command: list[str], environment: dict[str, str]) -> int:
    """Run a command and show its output only if it fails."""
    result = subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if result.returncode:
        print(result.stdout, file=sys.stderr)
    return result.returncode


def _fail(message: str) -> int:
    print(f"echotruth: {message}", file=sys.stderr)
    return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="echotruth", description=(echotruth.__doc__ or "").split("\n")[0])
    parser.add_argument("--version", action="version", version=echotruth.__version__)
    commands = parser.add_subparsers(dest="command", required=True)
    for name, text in (
        ("cases", "print the cases of a configuration as CSV"),
        ("run", "make the repository and the report of a configuration; other options are passed to Snakemake"),
    ):
        epilog = RUN_OPTIONS if name == "run" else None
        form = argparse.RawDescriptionHelpFormatter
        command = commands.add_parser(name, help=text, description=text, epilog=epilog, formatter_class=form)
        command.add_argument("config", help="YAML file, such as config/demo.yaml")
        if name == "run":
            command.add_argument("--upload", metavar="s3://BUCKET/FOLDER", help=UPLOAD)
    _add_upkeep(commands)
    _add_upload(commands)
    text = "compare the heart with exact solutions, published problems and conservation laws, and write the page"
    command = commands.add_parser("validate", help=text, description=text)
    command.add_argument("--quick", action="store_true", help="use coarse meshes; takes a few minutes")
    command.add_argument("--folder", default="docs", help="folder for validation.md (default: docs)")
    _add_export(commands)
    _add_describe(commands)
    _add_evaluate(commands)
    return parser


def _add_upkeep(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "check a configuration, or all files and values of a repository"
    command = commands.add_parser(
        "check",
        help=text,
        description=f"{text}. A repository is checked to the end, with one line for each fault.",
        epilog="examples: echotruth check config/demo.yaml; echotruth check out/demo; echotruth check out/demo --heal. "
        "Exit status: 0 nothing is damaged (jobs not run yet are no damage), 1 something is, 2 it cannot be checked.",
    )
    command.add_argument("config", metavar="path", help="YAML file, or folder of a repository, such as out/demo")
    command.add_argument("--heal", action="store_true", help="drop what is damaged, so that the next run makes just it")
    command.add_argument(
        "--quick", action="store_true", help="leave out the values of a repository: bytes at disk speed"
    )
    text = "take over the hearts of other repositories of the same settings"
    command = commands.add_parser(
        "merge",
        help=text,
        description=f"{text}. Their configurations may differ in their cases and their name only.",
        epilog="example: echotruth merge out/both out/first out/second",
    )
    command.add_argument("into", type=Path, help="folder of the repository that receives them; made if need be")
    command.add_argument("sources", type=Path, nargs="+", help="folders of repositories, which stay as they are")


EXPORTED = ("mp4", "gif", "png", "nifti", "dicom", "vtk", "matlab", "csv", "tap", "flo", "uff", "zea")
"""Formats of `echotruth export`."""


def _add_upload(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "upload a repository to object storage, and compare what is there by its checksums"
    command = commands.add_parser(
        "upload",
        help=text,
        description=f"{text} (docs/storage.md). What is there already is not sent again.",
        epilog="example: echotruth upload out/demo s3://bucket/demo. "
        "Exit status: 0 everything is there, 1 something is damaged, 2 it cannot be uploaded.",
    )
    command.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    command.add_argument("url", metavar="s3://BUCKET/FOLDER", help="where it has the same files; empty at first")
    command.add_argument("--verify", action="store_true", help="read back all that is there, and compare it")


def _add_export(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "write clips, hearts or RF of a repository as files of other programs"
    command = commands.add_parser(
        "export",
        help=text,
        description=f"{text} (docs/export.md), one for each clip: CASE_VIEW_SIZE.",
        epilog="example: echotruth export out/demo --format mp4 --view mid --overlay wall",
    )
    command.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    command.add_argument("--format", choices=EXPORTED, required=True, help="format of the files")
    for option, kind, text in (
        ("case", str, "case id from cases.csv; can be repeated (default: all)"),
        ("view", str, "name of the view; can be repeated (default: all)"),
        ("size", int, "image size, px; can be repeated (default: the largest)"),
        ("tracker", str, "tracker for matlab and csv; can be repeated (default: all)"),
        ("overlay", str, "wall, segments or displacement over mp4, gif and png; can be repeated (default: none)"),
    ):
        command.add_argument(f"--{option}", type=kind, action="append", default=[], help=text)
    command.add_argument("--rate", type=float, help="frames per second of mp4 and gif (default: 20)")
    command.add_argument(
        "-o", "--output", type=Path, help="folder, or the file if it is one (default: export/FORMAT in the repository)"
    )


def _add_describe(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "write a data card, a citation, Croissant and RO-Crate metadata of a repository"
    command = commands.add_parser(
        "describe",
        help=text,
        description=f"{text} (docs/description.md) into its folder.",
        epilog="example: echotruth describe out/demo --license CC-BY-4.0 --author 'Doe, Jane; 0000-0002-1825-0097'",
    )
    command.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    command.add_argument("-o", "--output", type=Path, help="another folder for the documents")
    command.add_argument("--license", help="identifier of SPDX, such as CC-BY-4.0, or an address (default: none)")
    text = "'Family, Given; ORCID; affiliation; its web address', or a group as 'Name; web address'; can be repeated"
    command.add_argument("--author", action="append", default=[], help=text)
    command.add_argument("--url", help="address at which the repository is published")
    command.add_argument("--release", default="1.0.0", help="version of the data (default: 1.0.0)")
    command.add_argument("--date", help="day of publication, as 2026-01-31 (default: that of the last job)")


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

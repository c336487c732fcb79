"""`echotruth check`: a configuration, or all files and values of a repository."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.cli.command import named

if TYPE_CHECKING:
    from echotruth.cases import Case
    from echotruth.config import Config


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth check`."""
    text = "YAML file, a name of `echotruth new --list`, or folder of a repository, such as out/demo"
    parser.add_argument("path", type=_path, help=f"{text}; sample is the repository of that name")
    parser.add_argument(
        "--quick", action="store_true", help="compare the checksums of the files only, and leave out their values"
    )


def check(arguments: argparse.Namespace) -> int:
    """Check a configuration, or all files and values of a repository.

    Of a configuration, the files that it names are read too. A repository is
    checked to the end, with one line for each fault.

    examples:
      echotruth check config/demo.yaml
      echotruth check out/demo
      echotruth check sample

    exit status:
      0  nothing is wrong (jobs not run yet are no damage)
      1  the configuration is not valid, a run would refuse it, or something is damaged
      2  it cannot be checked
    """
    if Path(arguments.path).is_dir():
        return _check_repository(Path(arguments.path), arguments.quick)
    from echotruth.cli.configuration import LISTED, load_cases

    config, cases = load_cases(arguments.path, f"a YAML file, {LISTED}, or the folder of a repository")
    if errors := [*_of_files(cases), *_of_inference(config, cases)]:
        sys.exit(named("\n".join(f"{arguments.path}: {error}" for error in errors)))
    print(f"{arguments.path}: valid; cases: {len(cases)}, views per case: {len(config.views)}")
    from echotruth.cli.run import print_concerns
    from echotruth.workflow.concerns import concerns

    found = list(concerns(config))
    print_concerns(found)
    return int(any(concern.is_absurd for concern in found))


def _path(path: str) -> str:
    """The path itself, or that of the shipped repository or configuration of this name."""
    from echotruth.config import shipped

    return shipped.found(str(shipped.repository(path)))


def _check_repository(folder: Path, quick: bool) -> int:
    """Print what is wrong with a repository; return the exit status."""
    from echotruth.repository.check import check
    from echotruth.repository.places import repository_folder

    def progress(done: int, number: int) -> None:
        if sys.stderr.isatty():
            print(f"\r\033[K{done} of {number} groups" if done < number else "\r\033[K", end="", file=sys.stderr)

    found = check(repository_folder(folder), progress, quick)
    print("\n".join(map(str, [*found.faults, *found.notes])) or f"{folder}: nothing is wrong")
    print(f"{found.files} files, {found.groups} groups, {len(found.faults)} faults")
    return int(bool(found.faults))


def _of_inference(config: Config, cases: list[Case]) -> Iterator[str]:
    """What is wrong with that from which the muscle is inferred: the errors of the tracker, and the priors."""
    if not config.inference.tracker:
        return
    from echotruth.inference import tracker_errors
    from echotruth.inference.parameters import check_prior

    try:
        check_prior(config.inference.prior)
        tracker_errors.check(case.config for case in cases)
    except ValueError as error:
        yield f"inference: {error}"


def _of_files(cases: list[Case]) -> Iterator[str]:
    """What is wrong with the meshes and motions in files, each of which is read once, as of the first case with it."""
    first: dict[tuple[str | None, str | None], Case] = {}
    for case in cases:
        motion = case.config.motion
        path = motion.file.path if motion.kind == "file" else None
        if case.config.geometry.file or path:
            first.setdefault((case.config.geometry.file, path), case)
    if not first:
        return
    from echotruth.loop.recording import LoopError
    from echotruth.mechanics.beat import fillable_ventricle
    from echotruth.mechanics.geometry import GeometryError, left_ventricle
    from echotruth.mechanics.motion_file.wall import moving_wall
    from echotruth.mechanics.prescribed import MotionError

    for (_, path), case in first.items():
        try:
            if path:
                moving_wall(case.config)
            elif case.config.motion.kind == "beat":
                fillable_ventricle(case.config)
            else:
                left_ventricle(case.config.geometry)
        except (GeometryError, LoopError, MotionError) as error:
            yield str(error)

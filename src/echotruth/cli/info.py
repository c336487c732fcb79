"""`echotruth info`: this installation, or a repository at a glance."""

from __future__ import annotations

import argparse
import os
import platform
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import echotruth
from echotruth.cli.command import fail

if TYPE_CHECKING:
    from echotruth.repository.reader import Repository

GIB = 2**30


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth info`."""
    text = "folder of a repository, such as out/demo (default: show the installation)"
    parser.add_argument("repository", nargs="?", help=text)


def info(arguments: argparse.Namespace) -> int:
    """Show what is installed, or what a repository holds and how to open it.

    examples:
      echotruth info
      echotruth info out/demo
      echotruth info sample

    exit status:
      0  it is printed
      2  there is no such repository
    """
    if arguments.repository is None:
        _print(_installation())
        return 0
    from echotruth.config import shipped
    from echotruth.config.loading import ConfigError
    from echotruth.repository.places import repository_folder
    from echotruth.repository.reader import Repository

    place = arguments.repository
    try:
        found = Repository(repository_folder(shipped.repository(place)))
        _print(_repository(found))
    except ConfigError:
        raise
    except (ValueError, KeyError) as error:
        return fail(f"{place}: is damaged ({' '.join(str(error).split())}): run echotruth check {place}")
    print(f'\nOpen it:\n  import echotruth as et\n  repository = et.Repository("{place}")')
    if found.shown and found.views:
        print(f'  clip = repository.clip("{found.shown[0]}", "{found.views[0]}")')
    return 0


def _print(lines: dict[str, str]) -> None:
    width = max(map(len, lines))
    print("\n".join(f"{name:{width}}  {text}" for name, text in lines.items() if text))


def _bytes(number: int) -> str:
    """Size in words."""
    return f"{number / GIB:.1f} GiB" if number >= GIB else f"{1024 * number / GIB:.1f} MiB"


def _installation() -> dict[str, str]:
    """What is installed."""
    from echotruth.repository.version import packages

    return {
        "echotruth": f"{echotruth.__version__}, {Path(echotruth.__file__).parent}",
        "Python": f"{platform.python_version()} on {platform.system()} {platform.release()} ({platform.machine()})",
        "packages": ", ".join(f"{name} {version}" for name, version in packages().items() if name != "echotruth"),
    }


def _repository(found: Repository) -> dict[str, str]:
    """What a repository holds."""
    from echotruth.repository.checksums import CHECKSUMS

    config, cases, packages = found.config, found.cases, found.attributes("").get("packages", {})
    statuses = ", ".join(f"{number} {status}" for status, number in cases["status"].value_counts().items())
    views = [f"{name} ({view.plane.replace('_', ' ')})" for name, view in config.views.items()]
    made = ", ".join(f"{name} {packages[name]}" for name in ("echotruth", "numpy", "zarr") if name in packages)
    is_published = (found.folder / CHECKSUMS).is_file()
    sizes, (files, size) = ", ".join(map(str, found.sizes)), _size(found.folder)
    beats = len(config.loop.beats)
    of = "one cycle" if beats == 1 else f"{beats} beats"
    return {
        "repository": f"{found.folder}",
        "name": f"{config.name}, seed {config.seed}",
        "heart": f"{config.geometry.file or config.geometry.preset}, {config.loop.frames} frames of {of}",
        "cases": f"{len(cases)}: {statuses}",
        "views": f"{len(views)}: {', '.join(views)}",
        "sizes": f"{sizes} px, {config.bmode.field_of_view_mm:g} mm wide; array {config.probe.preset}",
        "RF": ", ".join(["lines", *config.rf.keep]),
        "trackers": ", ".join(config.tracking.trackers),
        "on disk": f"{_bytes(size)} in {files} files",
        "made by": made if is_published else "not published yet: run it to its end",
    }


def _size(folder: Path) -> tuple[int, int]:
    """Number and size of the files below a folder; those that vanish meanwhile are left out."""
    number = size = 0
    for at, _, names in os.walk(folder):
        for name in names:
            with suppress(FileNotFoundError):
                size += os.lstat(f"{at}/{name}").st_size
                number += 1
    return number, size

"""`echotruth info`: this installation, or a repository at a glance."""

import argparse
import platform
from pathlib import Path

import echotruth
from echotruth.cli.command import fail


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
        _print_installation()
        return 0
    from echotruth.config import shipped
    from echotruth.config.loading import ConfigError
    from echotruth.repository.places import repository_folder
    from echotruth.repository.reader import Repository

    place = arguments.repository
    try:
        found = Repository(repository_folder(shipped.repository(place)))
        print(found)
    except ConfigError:
        raise
    except (ValueError, KeyError) as error:
        return fail(f"{place}: is damaged ({' '.join(str(error).split())}): run echotruth check {place}")
    print(f'\nOpen it:\n  import echotruth as et\n  repository = et.Repository("{place}")')
    if found.shown and found.views:
        print(f'  clip = repository.clip("{found.shown[0]}", "{found.views[0]}")')
    return 0


def _print_installation() -> None:
    from echotruth.repository.version import packages

    print(f"echotruth {echotruth.__version__}, {Path(echotruth.__file__).parent}")
    print(f"Python {platform.python_version()} on {platform.platform()}")
    print(*(f"{name} {version}" for name, version in packages().items() if name != "echotruth"), sep=", ")

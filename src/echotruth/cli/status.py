"""`echotruth status`: what of a repository is made, and which hearts have no result and why."""

import argparse
import json
from pathlib import Path

EXIT = {"finished": 0, "stopped": 1, "running": 3}
"""Exit status by the state of the repository."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth status`."""
    parser.add_argument("path", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("--json", action="store_true", help="print it as JSON")


def status(arguments: argparse.Namespace) -> int:
    """Show what of a repository is made, whether a run works on it, and which hearts failed and why.

    It only reads the folder, so it works on every machine that sees the folder, also for a run on a
    cluster.

    examples:
      echotruth status out/demo
      watch echotruth status out/demo
      echotruth status out/demo --json

    exit status:
      0  the repository is finished
      1  it is not finished, and no run works on it
      2  it is not a repository
      3  a run works on it
    """
    from echotruth.config import shipped
    from echotruth.repository.places import repository_folder
    from echotruth.workflow.status import status_of, text

    found = status_of(repository_folder(shipped.repository(arguments.path)))
    print(json.dumps(found, indent=2) if arguments.json else text(found))
    return EXIT[found["state"]]

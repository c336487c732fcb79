"""`echotruth status`: what of a repository is made, what runs, what failed and why, and how long it will take."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.cli.command import fail

if TYPE_CHECKING:
    from echotruth.workflow.status import Status

WATCH_SECONDS = 5.0
"""Interval of `--watch`."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth status`."""
    parser.add_argument("path", type=Path, help="folder of the repository, such as out/demo, or its YAML file")
    parser.add_argument("--watch", action="store_true", help="show it again every 5 s, until the run has ended")
    parser.add_argument("--json", action="store_true", help="print it as JSON")


def status(arguments: argparse.Namespace) -> int:
    """Show what of a repository is finished, running or failed, with reasons, and the time left.

    It only reads the folder, so it works on every machine that sees the folder, also for a run on a
    cluster.

    examples:
      echotruth status out/demo
      echotruth status out/demo --watch
      echotruth status config/sweep.yaml
      echotruth status out/demo --json

    exit status:
      0  the repository is finished
      1  it is not finished, and no run works on it
      2  it is not a repository
      3  a run works on it
    """
    from echotruth.workflow.status import StatusError, text

    is_drawn, last = sys.stdout.isatty() and not arguments.json and arguments.watch, ""
    try:
        while True:
            found = _found(arguments.path)
            shown = json.dumps(found, indent=2) if arguments.json else text(found)
            if shown != last:
                # On a terminal the earlier text is replaced, elsewhere another follows it.
                print(f"\033[H\033[2J{shown}" if is_drawn else shown, flush=True)
            last = shown
            if not arguments.watch or found["state"] != "running":
                return {"finished": 0, "running": 3}.get(found["state"], 1)
            time.sleep(WATCH_SECONDS)
    except StatusError as error:
        return fail(str(error))
    except KeyboardInterrupt:
        return 3


def _found(path: Path) -> Status:
    from echotruth.config import shipped
    from echotruth.workflow.status import status_before, status_of

    path = Path(shipped.repository(path))
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        return status_of(path.parent if path.suffix == ".zarr" else path)
    from echotruth.cli.configuration import load_cases

    config, cases = load_cases(str(path))
    return status_before(config, [case.id for case in cases], Path("out") / config.name)

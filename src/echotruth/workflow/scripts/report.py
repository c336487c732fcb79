"""Draw the figures of a repository."""

import argparse
import sys
from pathlib import Path

from echotruth.config.loading import load
from echotruth.report.figures import PARTS, Figures
from echotruth.workflow.compiled import lock_cache_writes

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
parser.add_argument("part", choices=PARTS, help="figures to draw")
arguments = parser.parse_args()
lock_cache_writes()
folder = arguments.repository
config = load(folder / "config.yaml")
try:
    Figures(folder / f"{config.name}.zarr", config, folder / "figures").draw(arguments.part)
except ValueError as error:
    sys.exit(f"report: {error}")

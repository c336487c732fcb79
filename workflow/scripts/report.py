"""Draw the figures of a repository."""

import argparse
import sys
from pathlib import Path

from echotruth.config.loading import load
from echotruth.report.figures import PARTS, Figures
from echotruth.workflow.compiled import share

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, as out/demo")
parser.add_argument("part", choices=PARTS, help="which figures")
given = parser.parse_args()
share()
config = load(given.repository / "config.yaml")
try:
    Figures(given.repository / f"{config.name}.zarr", config, given.repository / "figures").draw(given.part)
except ValueError as error:
    sys.exit(f"report: {error}")

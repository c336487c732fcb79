"""Draw the figures of a repository."""

import argparse
import sys
from pathlib import Path

from echotruth.config.loading import load
from echotruth.report.figures import Figures

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, as out/demo")
folder = parser.parse_args().repository
config = load(folder / "config.yaml")
try:
    Figures(folder / f"{config.name}.zarr", config, folder / "figures").draw()
except ValueError as error:
    sys.exit(f"report: {error}")

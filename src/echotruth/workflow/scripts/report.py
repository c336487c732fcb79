"""Draw the figures of a repository, or write the page that shows them."""

import argparse
from pathlib import Path

from echotruth.config.loading import load
from echotruth.report import page
from echotruth.report.figures import PARTS, Figures
from echotruth.workflow.compiled import lock_cache_writes

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
parser.add_argument("part", choices=[*PARTS, "page"], help="figures to draw, or the page")
arguments = parser.parse_args()
lock_cache_writes()
folder = arguments.repository
config = load(folder / "config.yaml")
if arguments.part == "page":
    page.write(folder, config)
else:
    Figures(folder / f"{config.name}.zarr", config, folder / "figures").draw(arguments.part)

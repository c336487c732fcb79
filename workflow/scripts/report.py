"""Draw the figures of a repository, and write the page that shows them."""

import argparse
from pathlib import Path

from echotruth.config.loading import load
from echotruth.report import page
from echotruth.report.figures import Figures

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
folder = parser.parse_args().repository
config = load(folder / "config.yaml")
Figures(folder / f"{config.name}.zarr", config, folder / "figures").draw()
page.write(folder, config)

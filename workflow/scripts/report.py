"""Draw the figures of a repository, and write the page that shows them."""

import argparse
from pathlib import Path

from echotruth.report import page
from echotruth.report.figures import Figures
from echotruth.repository.reader import Repository

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
repository = Repository(parser.parse_args().repository)
Figures(repository, repository.folder / "figures").draw()
page.write(repository)

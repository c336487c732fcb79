"""Draw the figures of a repository, and write the page that shows them."""

import argparse
import sys
from pathlib import Path

from echotruth.report import page
from echotruth.report.figures import Figures
from echotruth.repository.reader import Repository

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
parser.add_argument("--threads", type=int, default=1, help="processes that draw")
arguments = parser.parse_args()
try:
    repository = Repository(arguments.repository)
    Figures(repository, repository.folder / "figures").draw(arguments.threads)
    page.write(repository)
except OSError as error:
    sys.exit(f"report: {error}")

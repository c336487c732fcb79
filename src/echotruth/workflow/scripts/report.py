"""Draw the figures of a repository, or write the page that shows them."""

import argparse
from pathlib import Path

from echotruth.report import page
from echotruth.report.figures import PARTS, Figures
from echotruth.repository.reader import Repository
from echotruth.workflow.compiled import lock_cache_writes

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
parser.add_argument("part", choices=[*PARTS, "page"], help="figures to draw, or the page")
arguments = parser.parse_args()
lock_cache_writes()
repository = Repository(arguments.repository)
if arguments.part == "page":
    page.write(repository)
else:
    Figures(repository, repository.folder / "figures").draw(arguments.part)

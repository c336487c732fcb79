"""`echotruth describe`: documents that describe a repository."""

import argparse
from pathlib import Path

from echotruth.cli.attribution import add_attribution, attribution


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth describe`."""
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("-o", "--output", type=Path, help="folder for the documents (default: that of the repository)")
    add_attribution(parser)


def describe(arguments: argparse.Namespace) -> int:
    """Write a data card, a citation, Croissant and a table of the clips of a finished repository.

    They are written into its folder. It needs the extra description of echotruth.

    examples:
      echotruth describe out/demo --license CC-BY-4.0 --author 'Doe, Jane; 0000-0002-1825-0097'

    exit status:
      0  all documents are written
      2  it cannot be described
    """
    from echotruth.repository.reader import Repository
    from echotruth.sharing.description import describe as write

    for path in write(Repository(arguments.repository), arguments.output, attribution(arguments)):
        print(path)
    return 0

"""`echotruth describe`: documents that describe a repository."""

import argparse
from pathlib import Path

from echotruth.cli.command import fail


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth describe`."""
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("-o", "--output", type=Path, help="folder for the documents (default: that of the repository)")
    add_attribution(parser)


def add_attribution(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what is to be said of a repository beyond its content."""
    parser.add_argument("--license", help="identifier of SPDX, such as CC-BY-4.0, or an address (default: none)")
    text = "'Family, Given; ORCID; affiliation; its web address', or a group as 'Name; web address'; can be repeated"
    parser.add_argument("--author", action="append", default=[], help=text)
    parser.add_argument("--url", help="address at which the repository is published")
    parser.add_argument("--release", default="1.0.0", help="version of the data (default: 1.0.0)")
    parser.add_argument("--date", help="day of publication, as 2026-01-31 (default: that of the last job)")


def describe(arguments: argparse.Namespace) -> int:
    """Write a data card, a citation, Croissant and RO-Crate metadata of a repository.

    They are written into its folder. It needs the extra description of echotruth.

    examples:
      echotruth describe out/demo --license CC-BY-4.0 --author 'Doe, Jane; 0000-0002-1825-0097'

    exit status:
      0  all documents are written
      2  it cannot be described
    """
    from echotruth.repository.description import DescriptionError, attribution
    from echotruth.repository.description import describe as write
    from echotruth.workflow import lease

    try:
        given = attribution(arguments.author, arguments.license, arguments.url, arguments.release, arguments.date)
        lease.follow(arguments.repository)
        documents = write(arguments.repository, arguments.output, given)
    except (DescriptionError, lease.LeaseError) as error:
        return fail(str(error))
    for path in documents:
        print(path)
    return 0

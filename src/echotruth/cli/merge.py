"""`echotruth merge`: the hearts of other repositories taken over into one."""

import argparse
from pathlib import Path

from echotruth.cli.command import fail


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth merge`."""
    parser.add_argument("into", type=Path, help="folder of the repository that receives them; made if need be")
    parser.add_argument("sources", type=Path, nargs="+", help="folders of repositories, which stay as they are")


def merge(arguments: argparse.Namespace) -> int:
    """Take over the hearts of other repositories of the same settings.

    Their configurations may differ in their cases and their name only.

    examples:
      echotruth merge out/both out/first out/second
      echotruth merge out/mine sample

    exit status:
      0  all hearts are taken over
      2  they cannot be merged
    """
    from echotruth.config import shipped
    from echotruth.workflow.merging import merge_repositories

    if shipped.is_sample(arguments.into):
        return fail(f"{arguments.into}: {shipped.NOT_WRITTEN}")
    return merge_repositories(arguments.into, [Path(shipped.repository(source)) for source in arguments.sources])

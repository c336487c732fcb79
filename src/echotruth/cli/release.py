"""`echotruth release`: the files of a repository that one would upload."""

import argparse
from pathlib import Path

from echotruth.cli.attribution import add_attribution, attribution
from echotruth.cli.command import count


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth release`."""
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("--to", type=Path, help="folder for the files (default: REPOSITORY-release)")
    parser.add_argument(
        "--part-mb", type=count, default=2000, metavar="N", help="largest size of a part, MB (default: %(default)s)"
    )
    add_attribution(parser)


def release(arguments: argparse.Namespace) -> int:
    """Write the files that one would upload to give a repository away.

    These are archives of whole hearts and clips, of a stated size, a registry of their checksums for pooch, a data
    card that Hugging Face reads, Croissant and a citation. echotruth.fetch reads them from
    wherever they are. It needs the extra description of echotruth.

    examples:
      echotruth release out/demo --license CC-BY-4.0 --author 'Doe, Jane; 0000-0002-1825-0097'
      echotruth release out/demo --to demo-1.0.0 --part-mb 500

    exit status:
      0  all files are written
      2  it cannot be released
    """
    from echotruth.repository.reader import Repository
    from echotruth.sharing.release import release as write

    repository = Repository(arguments.repository)
    name = f"{repository.config.name}-release"
    folder = arguments.to or (Path("out") if repository.is_sample else repository.folder.parent) / name
    for path in write(repository, folder, attribution(arguments), arguments.part_mb * 10**6):
        print(path)
    return 0

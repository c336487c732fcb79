"""`echotruth validate`: the mechanics against what is known."""

import argparse
import sys
from pathlib import Path

from echotruth.cli.command import fail


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth validate`."""
    parser.add_argument("--quick", action="store_true", help="use coarse meshes; takes a few minutes")
    parser.add_argument("--folder", default="docs", help="folder for validation.md (default: docs)")


def validate(arguments: argparse.Namespace) -> int:
    """Compare the heart with exact solutions, published problems and conservation laws, and write the page.

    It needs a checkout of echotruth.

    examples:
      echotruth validate --quick --folder /tmp

    exit status:
      0  all checks pass
      1  a check fails
      2  this folder is not a checkout
    """
    if not Path("validation/page.py").is_file():
        return fail("no folder validation in this folder: run this in a checkout of echotruth")
    sys.path.insert(0, str(Path.cwd()))
    from validation.page import write

    folder = Path(arguments.folder)
    passed = write(folder, arguments.quick, lambda line: print(line, flush=True))
    print(f"\nPage: {folder / 'validation.md'}")
    return 0 if passed else 1

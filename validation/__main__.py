"""The mechanics against exact solutions, published problems and conservation laws, as a page: `make validation`."""

import argparse
import sys
from pathlib import Path

from validation import page


def main() -> None:
    """Run all checks, write the page, and end the process with status 1 where a number is off."""
    parser = argparse.ArgumentParser("python -m validation", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="use coarse meshes; takes a few minutes")
    parser.add_argument("--folder", type=Path, default="docs", help="folder for validation.md (default: docs)")
    given = parser.parse_args()
    passed = page.write(given.folder, given.quick, lambda line: print(line, flush=True))
    print(f"\nPage: {given.folder / 'validation.md'}")
    sys.exit(not passed)


if __name__ == "__main__":
    main()

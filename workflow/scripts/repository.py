"""Verify the files of all jobs, and publish the repository as one hierarchy."""

import argparse
import sys
from pathlib import Path

from echotruth.repository import ledger
from echotruth.repository.checksums import ChecksumError
from echotruth.repository.publication import publish

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
try:
    folder = ledger.repository_folder(parser.parse_args().repository)
    summary = publish(folder)
except (ChecksumError, FileNotFoundError) as error:
    sys.exit(f"repository: {error}")
ledger.commit(folder / "ledger/repository.json", summary)
files = summary.pop("files")
print("repository:", ", ".join(f"{number} {status}" for status, number in summary.items()), f"({files} files verified)")

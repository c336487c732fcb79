"""Publish the groups of all jobs as one repository: table of cases, metadata, checksums."""

import argparse
import sys
from pathlib import Path

from echotruth.cases import expand
from echotruth.config.loading import ConfigError, load
from echotruth.repository.places import repository_folder
from echotruth.repository.publication import publish

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
try:
    folder = repository_folder(parser.parse_args().repository)
    config = load(folder / "config.yaml")
    found = publish(folder, config, expand(config))
except (ConfigError, OSError) as error:
    sys.exit(f"repository: {error}")
print("repository:", ", ".join(f"{number} {status}" for status, number in found.items()))

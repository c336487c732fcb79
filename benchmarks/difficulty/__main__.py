"""Print how difficult the clips of a repository are to track: docs/difficulty.md.

python -m benchmarks.difficulty out/demo > difficulty.csv
"""

import argparse
import sys

import pandas as pd

from benchmarks.difficulty.floors import COLUMNS, difficulty
from echotruth.repository.reader import Repository

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("repository", help="its folder, as out/demo")
repository = Repository(parser.parse_args().repository)
finished = repository.finished(None, None, "truth", "bmode")
rows = [row for case, views in finished for view in views for row in difficulty(repository, case.id, view)]
pd.DataFrame(rows, columns=list(COLUMNS)).to_csv(sys.stdout, index=False)

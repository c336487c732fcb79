"""Parts of the suite that were made, benchmarks/results/suite2/part-KK.csv.gz."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from .columns import TEXT

FOLDER = Path(__file__).parents[1] / "results/suite2"
"""Where parts are kept."""


def read_parts(folder: Path = FOLDER) -> pd.DataFrame:
    """All parts, and those of further trackers, as one table with the columns of :mod:`.columns`.

    Raises
    ------
    ValueError
        If there is none, or they are of different code.
    """
    files = sorted(folder.glob("part-*.csv.gz"))
    if not files:
        raise ValueError(f"{folder}: has no part of the suite: make one by python -m benchmarks.suite part 1")
    found = {
        file.name: pd.read_csv(file, dtype=dict.fromkeys(TEXT, str), keep_default_na=False, na_values=[""])
        for file in files
    }
    return pd.concat(found.values(), ignore_index=True)

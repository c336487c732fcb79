"""Table of the difficulty of the clips of a repository."""

import json
from contextlib import suppress
from math import isnan

import numpy as np
import pandas as pd

from echotruth import files
from echotruth.evaluation.difficulty.floors import COLUMNS, PARAMETERS, Row, difficulty
from echotruth.repository.choice import Names
from echotruth.repository.reader import Repository

_VERSION = 1
"""Of what is kept of a clip; to be raised when its definition changes."""


def difficulties(repository: Repository, cases: Names = None, views: Names = None) -> pd.DataFrame:
    """Determine how difficult the clips of a repository are to track.

    What was found of a clip is kept in the folder `scratch` of the repository, until its images or truth change, or the
    frames and points at which it is to be tracked.

    Parameters
    ----------
    repository : Repository
    cases, views : iterable of str, optional
        Those to include. Default: all whose images and truth are complete.

    Returns
    -------
    DataFrame
        Rows of :func:`difficulty` of all these clips.

    Raises
    ------
    ValueError
        If the repository does not have one of them.
    """
    finished = repository.finished(cases, views, "truth", "bmode")
    rows = [row for case, complete in finished for view in complete for row in _kept(repository, case.id, view)]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _kept(repository: Repository, case: str, view: str) -> list[Row]:
    """Rows of a clip, as they were kept of the same images, truth and points, or determined now and kept."""
    path = repository.folder / "scratch" / case / view / "difficulty.json"
    key = [_VERSION, PARAMETERS, repository.version(case, view)]
    with suppress(OSError, ValueError, KeyError, TypeError):  # there is none, or it is damaged
        kept = json.loads(path.read_text())
        if kept["key"] == key:
            return [{name: np.nan if row[name] is None else row[name] for name in COLUMNS} for row in kept["rows"]]
    rows = difficulty(repository, case, view)
    # JSON has no NaN.
    content = [{n: None if isinstance(v, float) and isnan(v) else v for n, v in row.items()} for row in rows]
    with suppress(OSError):  # a repository that cannot be written can be read
        if not repository.is_sample:
            files.write(path, json.dumps({"key": key, "rows": content}).encode())
    return rows

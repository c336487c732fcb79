"""Table of the difficulty of the clips of a repository."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echotruth.config.loading import load
from echotruth.evaluation.choice import cases_of, jobs_of
from echotruth.evaluation.difficulty.floors import COLUMNS, PARAMETERS, Row, difficulty
from echotruth.evaluation.digest import digest
from echotruth.repository import durable
from echotruth.workflow.job import Job

if TYPE_CHECKING:
    import pandas as pd

_VERSION = 1
"""Of what is kept of a clip; to be raised when its definition changes."""


def difficulties(folder: Path, cases: Sequence[str] | None = None, views: Sequence[str] | None = None) -> pd.DataFrame:
    """Determine how difficult the clips of a repository are to track.

    What was found of a clip is kept in the folder `scratch` of the repository, until its images or truth change, or the
    frames and points at which it is to be tracked.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    cases, views : sequence of str, optional
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
    import pandas as pd

    config = load(folder / "config.yaml")
    known = cases_of(folder, config)
    rows = [row for job in jobs_of(folder, config, known, cases, views, "truth", "bmode") for row in _kept(job)]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _kept(job: Job) -> list[Row]:
    """Rows of a clip, as they were kept of the same images, truth and points, or determined now and kept."""
    path = job.scratch / "difficulty.json"
    tracking, images = job.case.config.tracking, digest(job.folder, job.case.id, str(job.view_name))
    key = [_VERSION, PARAMETERS, tracking.frame_step, tracking.grid_px, images]
    with suppress(OSError, ValueError, KeyError, TypeError):  # there is none, or it is damaged
        kept = json.loads(path.read_text())
        if kept["key"] == key:
            return [{name: np.nan if row[name] is None else row[name] for name in COLUMNS} for row in kept["rows"]]
    rows = difficulty(job)
    # JSON has no NaN.
    content = [{n: None if isinstance(v, float) and isnan(v) else v for n, v in row.items()} for row in rows]
    with suppress(OSError):  # a repository that cannot be written can be read
        durable.write(path, json.dumps({"key": key, "rows": content}).encode())
    return rows

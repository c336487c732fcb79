"""Scores of trackers on variants of the clips of a repository, `external/NAME.mirrored.json` and `NAME.open.json`.

A file has the settings of the tracker and a row for each case, view and image size. Scores on clips that have changed
since, or with other settings, are older and do not count.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from echotruth import files
from echotruth.evaluation.leaderboard import is_current
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository import estimates
from echotruth.repository.reader import Repository

COLUMNS = ("case", "view", "size_px", "clip", "error_percent", "before_percent", "failure")
"""Columns of a row: error in the variant, and in the same frame of the clip as it was scored, as `nrmse_all` has them;
the others are those of `external/NAME.csv`."""

Row = dict[str, Any]
"""One clip, by `COLUMNS`."""


class Result(NamedTuple):
    """Scores of a tracker on variants of clips.

    Attributes
    ----------
    rows : DataFrame
        Columns `COLUMNS`, of those that count.
    older : int
        Number of those that do not, because the clip or the settings of the tracker have changed since.
    """

    rows: pd.DataFrame
    older: int


def result_path(folder: Path, tracker: str, variant: str) -> Path:
    """File of the scores of a tracker on variants of clips, external/NAME.VARIANT.json."""
    return folder / "external" / f"{tracker}.{variant}.json"


def write(repository: Repository, tracker: str, variant: str, rows: list[Row]) -> Path:
    """Write scores beside those of other cases, views and image sizes that count still.

    Parameters
    ----------
    repository : Repository
    tracker, variant : str
    rows : list of dict
        One for each clip, by `COLUMNS`.

    Returns
    -------
    Path
        The file.
    """
    earlier = result_of(repository, tracker, variant).rows.to_dict("records")
    of_clip = {(row["case"], row["view"], row["size_px"]): row for row in [*earlier, *rows]}
    values = {
        "settings": estimates.settings(repository, tracker),
        "clips": [of_clip[clip] for clip in sorted(of_clip)],
    }
    path = result_path(repository.folder, tracker, variant)
    files.write(path, f"{json.dumps(values, indent=1)}\n".encode())
    return path


def result_of(repository: Repository, tracker: str, variant: str) -> Result:
    """Scores of a tracker on variants of clips.

    Parameters
    ----------
    repository, tracker, variant
        As :func:`write` takes them.

    Raises
    ------
    EvaluationError
        If the file is not what was written.
    """
    path, settings = result_path(repository.folder, tracker, variant), estimates.settings(repository, tracker)
    try:
        values = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {"settings": {}, "clips": []}
        same = values["settings"] == settings
        rows = [{name: row[name] for name in COLUMNS} for row in values["clips"]]
        table = pd.DataFrame(rows, columns=list(COLUMNS)).astype(
            {"case": str, "view": str, "size_px": int, "error_percent": float, "before_percent": float}
        )
    except (ValueError, TypeError, KeyError) as error:
        raise EvaluationError(f"{path}: is not what was written: delete it, and run {tracker} again") from error
    clips = zip(table["case"], table["view"], table["clip"], strict=True)
    counts = np.array([same and is_current(repository, *one) for one in clips], bool)
    return Result(table[counts].reset_index(drop=True), int((~counts).sum()))

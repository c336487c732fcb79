"""Parts of the suite: eight hearts each, whose scores are kept in benchmarks/results/suite2/part-KK.csv.gz.

What a tracker costs differs from run to run; it is in a file of its own, cost-KK.csv, so that the scores of a part are
the same bytes wherever it is made.
"""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from echotruth import files
from echotruth.evaluation.parallel import in_processes

from .columns import IDENTITY, TEXT
from .hearts import plan, suite_version
from .scores import Row, heart_rows

FOLDER = Path(__file__).parents[1] / "results/suite2"
SCRATCH = Path("out/suite2")
"""Where the rows of each heart are kept, so that a part goes on where it was stopped, and the part `small`."""

SMALL, SMALL_HEARTS = 0, 4
"""Part of so many hearts of part 1, for everyday work; it is not read with the others."""

CLIP = ("case", "view", "size_px")
DIGITS = "%.5g"


def make_part(part: int, jobs: int = 1, trackers: Path | None = None, say: Callable[[str], None] = print) -> Path:
    """Make the hearts of a part, score the trackers on them, and write the scores.

    Parameters
    ----------
    part : int
        From 1; `SMALL` is the small one.
    jobs : int
        Number of processes.
    trackers : Path, optional
        YAML file of further trackers by name, as `tracking.trackers` has them, whose scores are put beside the part,
        which must be there. Default: the trackers of the suite.
    say : callable
        Is told how far it is.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        If there is no such part, or the images of further trackers are not those of the part.
    """
    hearts = [row for row in plan() if row["part"] == (part or 1)][: None if part else SMALL_HEARTS]
    if not hearts:
        raise ValueError(f"part {part}: is not there: use one of 1 to {plan()[-1]['part']}, or small")
    given = None if trackers is None else yaml.safe_load(trackers.read_text(encoding="utf-8"))
    folder = FOLDER if part else SCRATCH
    before = None if given is None else _read(folder / f"part-{part:02d}.csv.gz")
    rows: list[Row] = []
    for heart, found in zip(hearts, in_processes(partial(_kept, given), hearts, jobs), strict=True):
        rows += found
        say(f"{heart['heart']}, {heart['group']}: {len(found)} rows, {len(rows)} of part {part}")
    table = pd.DataFrame(rows).assign(part=part)
    if before is not None:
        _check_images(table, before)
    suffix = "" if trackers is None else f"-{trackers.stem}"
    cost = table.groupby(["species", "view", "size_px", "tracker"])["cpu_s"].agg(["count", "mean"]).reset_index()
    files.write(folder / f"cost-{part:02d}{suffix}.csv", cost.to_csv(index=False, float_format="%.3g").encode())
    path = folder / f"part-{part:02d}{suffix}.csv.gz"
    files.write(path, packed(table.drop(columns="cpu_s")))
    return path


def packed(table: pd.DataFrame) -> bytes:
    """A table as compressed CSV, the same bytes at any time."""
    first = [name for name in IDENTITY if name in table]
    others = [name for name in table if name not in first]
    text = table[[*first, *others]].to_csv(index=False, float_format=DIGITS, lineterminator="\n")
    found = io.BytesIO()
    with gzip.GzipFile(fileobj=found, mode="wb", mtime=0) as file:
        file.write(text.encode())
    return found.getvalue()


def read_parts(folder: Path = FOLDER) -> pd.DataFrame:
    """All parts, and those of further trackers, as one table with the columns of :mod:`.columns`.

    Raises
    ------
    ValueError
        If there is none, or they are of different code.
    """
    paths = sorted(folder.glob("part-*.csv.gz"))
    if not paths:
        raise ValueError(f"{folder}: has no part of the suite: make one by python -m benchmarks.suite part 1")
    found = {path.name: _read(path) for path in paths}
    code = {name: table["code"].iloc[0] for name, table in found.items()}
    first = next(iter(code))
    if other := [name for name in code if code[name] != code[first]]:
        raise ValueError(f"{folder}: {other[0]} was made with other code than {first}: make both with the same")
    return pd.concat(found.values(), ignore_index=True)


def _read(path: Path) -> pd.DataFrame:
    if not path.is_file():
        raise ValueError(f"{path}: is not there: make it without --tracker first")
    # Only an empty number is missing: that nothing failed is "", and a variation is called none.
    table = pd.read_csv(path, dtype=dict.fromkeys(TEXT, str), keep_default_na=False, na_values=[""])
    return table.fillna(dict.fromkeys(TEXT, ""))


def _kept(trackers: dict[str, Any] | None, heart: dict[str, Any]) -> list[Row]:
    """Rows of a heart, from its file if nothing has changed since; those of further trackers are not kept."""
    path = SCRATCH / suite_version() / f"{heart['heart']}.json"
    if trackers is not None:
        return heart_rows(heart, trackers)
    if not path.is_file():
        files.write(path, json.dumps(heart_rows(heart), default=lambda value: value.item()).encode())
    return json.loads(path.read_text(encoding="utf-8"))


def _check_images(table: pd.DataFrame, before: pd.DataFrame) -> None:
    """ValueError if the images of a table are not those that another table has of the same clips."""
    clips = [one.drop_duplicates(list(CLIP)).set_index(list(CLIP))["images"] for one in (table, before)]
    other = clips[0].index[(clips[0] != clips[1].reindex(clips[0].index)).to_numpy()]
    if len(other):
        case, view, size = other[0]
        raise ValueError(f"{case} {view} {size} px: its images are not those of the part: make the part again")

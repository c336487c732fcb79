"""Parts of the suite: eight hearts each, whose scores are kept in benchmarks/results/suite3/part-KK.csv.gz.

What a tracker costs differs from run to run; it is in a file of its own, cost-KK.csv, so that the scores of a part are
the same bytes wherever it is made with the same instructions of the processor, packages and C library
(docs/determinism.md).
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

from benchmarks.parallel import in_processes
from echotruth import files
from echotruth.config.loading import read_yaml
from echotruth.evaluation.leaderboard import RANKED_BY

from .columns import ABOUT, HASHES, IDENTITY, TEXT
from .hearts import plan, suite_version
from .scores import Row, heart_rows

FOLDER = Path(__file__).parents[1] / "results/suite3"
SCRATCH = Path("out/suite3")
"""Where the rows of each heart are kept, so that a part goes on where it was stopped, and the part `small`."""

SMALL, SMALL_HEARTS = 0, 4
"""Part of so many hearts of part 1, for everyday work; it is not read with the others."""

CLIP = ("case", "view", "size_px")
DIGITS = "%.5g"


def number(part: str) -> int:
    """Number of a part that is given by its number or as `small`; ValueError if there is none."""
    numbers = {"small": SMALL} | {str(row["part"]): int(row["part"]) for row in plan()}
    if part not in numbers:
        raise ValueError(f"part {part}: is not there: use one of 1 to {plan()[-1]['part']}, or small")
    return numbers[part]


def make_part(part: int, jobs: int = 1, trackers: Path | None = None, say: Callable[[str], None] = print) -> Path:
    """Make the hearts of a part, score the trackers on them, and write the scores.

    Parameters
    ----------
    part : int
        As :func:`number` returns it.
    jobs : int
        Number of processes.
    trackers : Path, optional
        YAML file of further trackers by name, as `tracking.trackers` has them, whose scores are put beside the part,
        which must be there. Default: the trackers of the suite.
    say : callable
        Receives how far it is.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        If the file names no tracker, or one that was scored already, or the images of further trackers are not those of
        the part.
    """
    hearts = [row for row in plan() if row["part"] == (part or 1)][: None if part else SMALL_HEARTS]
    folder, suffix = FOLDER if part else SCRATCH, "" if trackers is None else f"-{trackers.stem}"
    path = folder / f"part-{part:02d}{suffix}.csv.gz"
    given = None if trackers is None else _further(trackers, path)
    before = None if given is None else _read(folder / f"part-{part:02d}.csv.gz")
    rows: list[Row] = []
    for heart, found in zip(hearts, in_processes(partial(_kept, given), hearts, jobs), strict=True):
        rows += found
        say(f"{heart['heart']}, {heart['group']}: {len(found)} rows, {len(rows)} of part {part}")
    table = pd.DataFrame(rows).assign(part=part)
    if before is not None:
        _check_images(table, before)
    cost = table[[*CLIP, "tracker", "cpu_s"]].to_csv(index=False, float_format="%.3g")
    files.write(folder / f"cost-{part:02d}{suffix}.csv", cost.encode())
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

    It has no rows if there is no part.

    Raises
    ------
    ValueError
        If they are of different code, or a tracker has two rows of the same clip.
    """
    paths = sorted(folder.glob("part-*.csv.gz"))
    if not paths:
        names = (*IDENTITY, *ABOUT, *HASHES, RANKED_BY)
        return pd.DataFrame({name: pd.Series(dtype=str if name in TEXT else float) for name in names})
    found = {path.name: _read(path) for path in paths}
    code = {name: table["code"].iloc[0] for name, table in found.items()}
    first = next(iter(code))
    if other := [name for name in code if code[name] != code[first]]:
        raise ValueError(f"{folder}: {other[0]} was made with other code than {first}: make both with the same")
    table = pd.concat(found, names=["file"]).copy().reset_index("file")
    again = table[table.duplicated([*CLIP, "tracker"])]
    for file, tracker, case in again[["file", "tracker", "case"]].head(1).to_numpy():
        raise ValueError(f"{folder / file}: the tracker {tracker} is in {case} a second time: remove one of its files")
    return table.drop(columns="file").reset_index(drop=True)


def _read(path: Path) -> pd.DataFrame:
    if not path.is_file():
        raise ValueError(f"{path}: is not there: make it without --tracker first")
    # Only an empty number is missing: that nothing failed is "", and a variation is called none.
    table = pd.read_csv(path, dtype=dict.fromkeys(TEXT, str), keep_default_na=False, na_values=[""])
    return table.fillna(dict.fromkeys(TEXT, ""))


def _further(trackers: Path, path: Path) -> dict[str, Any]:
    """Further trackers of a YAML file, none of which is in another file of the part than `path`."""
    given = read_yaml(trackers)
    if not given:
        raise ValueError(f"{trackers}: names no tracker: write a mapping of names to settings")
    for file in sorted(path.parent.glob(f"{path.name[:7]}*.csv.gz")):
        for name in given if file != path else ():
            if name in set(_read(file)["tracker"]):
                raise ValueError(f"{trackers}: the tracker {name} is in {file} already: give it another name")
    return given


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
        raise ValueError(
            f"{case} {view} {size} px: its images are not those of the part, by other code, packages or instructions "
            "of the processor (docs/determinism.md): make the part again on this machine"
        )

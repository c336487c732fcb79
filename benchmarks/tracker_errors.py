"""Table of the errors of trackers at end-systole, by which parameters of hearts are inferred.

    python -m benchmarks.tracker_errors                                # the table of the package: the suite's hearts
    python -m benchmarks.tracker_errors out/inference                  # and those of config/inference.yaml
    python -m benchmarks.tracker_errors out/mine --all -o errors.csv   # one of hearts and trackers of your own

Only hearts whose label `split` is `develop` count, as the half develop of the suite; with --all those of every
finished case. Rows of other hearts stay in a table that is there.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import echotruth as et
from benchmarks.suite import columns, detection, parts
from echotruth.aha import APEX_SEGMENT
from echotruth.arrays import Floats
from echotruth.cases import Case
from echotruth.inference import tracker_errors
from echotruth.inference.observation import ObservationError, heart_name, seen_of

TRACKERS = ("dis", "bspline_dic", "bspline_cnn")
"""Of the suite, whose errors are kept."""
SUITE = "suite/"
"""Beginning of the names of its hearts."""

Row = tuple[str, int, str, str, str, str, str, Floats, Floats]
"""As `tracker_errors.table_of` takes it."""


def chosen(case: Case, every: bool) -> bool:
    """Whether the errors of a case are learned."""
    return every or case.labels.get("split") == "develop"


def errors(repository: et.Repository, every: bool) -> Iterator[Row]:
    """What was tracked and is true in the segments of the views of each case, tracker and size."""
    for case in repository.every.values():
        if not chosen(case, every):
            continue
        kind, heart = tracker_errors.acoustics(case.config), heart_name(repository, case)
        for tracker in repository.trackers:
            for size in repository.sizes:
                try:
                    for seen in seen_of(repository, case, tracker, size):
                        if seen.segments:
                            yield tracker, size, kind, seen.quantity, heart, case.id, seen.view, seen.tracked, seen.true
                except ObservationError as error:
                    print(f"left out: {error}")


def errors_of_suite() -> Iterator[Row]:
    """What was tracked and is true in the half develop of the suite. Hearts that move as a whole show no rotation."""
    table = parts.read_parts().query("split == 'develop' and tracker in @TRACKERS", local_dict={"TRACKERS": TRACKERS})
    if table.empty:
        raise SystemExit("there are no parts of the half develop: make parts 1 and 2 of the suite first")
    of_clip = ["tracker", "size_px", "acoustics", "heart", "case", "view"]
    for (*clip, heart, case, view), rows in detection.shown(columns.segments(table)).groupby(of_clip):
        seen = rows[rows["aha"] < APEX_SEGMENT].dropna(subset=["true_es_percent", "tracked_es_percent"])
        if len(seen):
            place = seen["component"].iloc[0], f"{SUITE}{heart}", case, view
            yield *clip, *place, *(seen[f"{what}_es_percent"].to_numpy() / 100 for what in ("tracked", "true"))
    turned = table[table["variation"] != "motion"].dropna(subset=list(columns.ROTATION))
    for row in turned.itertuples():
        place = "rotation", f"{SUITE}{row.heart}", row.case, row.view
        both = (np.radians([value]) for value in (row.tracked_rotation_es_deg, row.true_rotation_es_deg))
        yield row.tracker, row.size_px, row.acoustics, *place, *both


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repositories", type=Path, nargs="*")
    parser.add_argument("--all", action="store_true", help="every case, and not those to develop on alone")
    parser.add_argument("-o", "--output", type=Path, default=tracker_errors.SHIPPED)
    arguments = parser.parse_args()
    rows: list[Any] = [] if arguments.repositories else list(errors_of_suite())
    for place in arguments.repositories:
        rows += errors(et.Repository(place), arguments.all)
    table = tracker_errors.table_of(rows)
    if arguments.output.is_file():
        old, keys = tracker_errors.read(arguments.output), [*tracker_errors.KEYS, *tracker_errors.PLACE]
        if not arguments.repositories:
            old = old[~old["heart"].str.startswith(SUITE)]  # hearts of an earlier suite have the same names
        table = pd.concat([old, table]).drop_duplicates(keys, keep="last").sort_values(keys)
    table.to_csv(arguments.output, index=False, float_format="%.6f")
    print(f"{arguments.output}: {table['heart'].nunique()} hearts, {len(table)} rows")


if __name__ == "__main__":
    main()

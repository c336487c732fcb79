"""How well parameters of hearts are inferred: error and coverage of the intervals, from tables of `echotruth infer`.

    echotruth run benchmarks/inference_hearts.yaml
    python benchmarks/tracker_errors.py out/inference_hearts --all
    echotruth infer out/inference_hearts --tracker bspline_dic --size 256 -o out/inferred.csv
    python benchmarks/inference.py out/inferred.csv

Each heart is inferred with the errors of the other hearts. The results are results/inference.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from echotruth.inference.table import COLUMNS

OUTPUT = Path(__file__).parent / "results/inference.md"
SCAR = 0.5
"""Contractility, over the mean of the wall, below which a segment counts as scarred."""
HEAD = """# Parameters of hearts from what a tracker saw

Written by `benchmarks/inference.py`. Root mean square of the errors, the same of the means of the priors, and the share
of the 90 % intervals that hold the true value.

"""


def kinds(table: pd.DataFrame) -> pd.Series:
    """What each row is one of: `contractility`, seen or not, `stiffness`, or its own name."""
    kind = table["parameter"].str.replace(r"\.\d+$", "", regex=True)
    muscle = kind == "contractility"
    return kind.mask(muscle & table["identifiable"], "contractility, identifiable").mask(
        muscle & ~table["identifiable"], "contractility, not identifiable"
    )


def area_under_curve(score: np.ndarray, positive: np.ndarray) -> float:
    """Probability that a positive has a higher score than another; NaN if there is none of either."""
    pairs = score[positive][:, None] - score[~positive][None]
    return float(np.mean((pairs > 0) + 0.5 * (pairs == 0))) if pairs.size else np.nan


def summary(table: pd.DataFrame) -> list[str]:
    """Lines of one tracker and size."""
    hearts = table.drop_duplicates("case")
    flagged, unfinished = hearts["misfit"].sum(), (~hearts["converged"]).sum()
    lines = [f"{len(hearts)} hearts; {flagged} with a misfit, {unfinished} not converged.", ""]
    lines += ["| parameter | number | RMS error | of the prior | 90 % intervals that hold |", "|---|---|---|---|---|"]
    for kind, rows in table.groupby(kinds(table), sort=False):
        error, before = (np.sqrt(np.mean((rows[name] - rows["true"]) ** 2)) for name in ("mean", "prior_mean"))
        held = np.mean((rows["lower"] <= rows["true"]) & (rows["true"] <= rows["upper"]))
        lines.append(f"| {kind} | {len(rows)} | {error:.3g} | {before:.3g} | {100 * held:.0f} % |")
    muscle = table[table["parameter"].str.startswith("contractility") & table["identifiable"]]
    area = area_under_curve(-muscle["mean"].to_numpy(), (muscle["true"] < SCAR).to_numpy())
    return [*lines, "", f"Scarred segments among the identifiable ones: area under the ROC curve {area:.2f}.", ""]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", type=Path, nargs="+", help="tables that echotruth infer wrote")
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    arguments = parser.parse_args()
    table = pd.concat([pd.read_csv(path, usecols=list(COLUMNS)) for path in arguments.tables]).dropna(subset="true")
    lines = []
    for (tracker, size), rows in table.groupby(["tracker", "size_px"]):
        lines += [f"## {tracker}, {size} px", "", *summary(rows)]
    arguments.output.write_text(HEAD + "\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()

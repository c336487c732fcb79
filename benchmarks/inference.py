"""How well parameters of hearts are inferred: error, coverage and calibration of the posteriors of repositories.

    echotruth run benchmarks/inference_hearts.yaml
    python benchmarks/inference.py out/inference_hearts

A .csv that `echotruth infer` wrote is taken in place of a repository; it has no draws, and so no ranks. Each heart is
inferred with the errors of the other hearts. The results are results/inference.md.

The rank of a true value is the share of the draws of its posterior that are below it. If the posteriors are calibrated,
ranks are uniform: as many in the first fifth as in each other (simulation-based calibration, Talts 2018,
arXiv:1804.06788).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

import echotruth as et
from echotruth.repository import inferred, schema

OUTPUT = Path(__file__).parent / "results/inference.md"
SCAR = 0.5
"""Contractility, over the mean of the wall, below which a segment counts as scarred."""
BINS = 5
"""Of the histogram of ranks."""
HEAD = """# Parameters of hearts from what a tracker saw

Written by `benchmarks/inference.py`. Root mean square of the errors, the same of the means of the priors, mean of the
errors, the share of the 90 % intervals that hold the true value, and how many ranks of true values are in each fifth.

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
    head = ("parameter", "number", "RMS error", "of the prior", "mean error", "90 % intervals that hold", "ranks")
    lines += [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for kind, rows in table.groupby(kinds(table), sort=False):
        error, before = (np.sqrt(np.mean((rows[name] - rows["true"]) ** 2)) for name in ("mean", "prior_mean"))
        bias, held = np.mean(rows["mean"] - rows["true"]), np.mean(rows["true"].between(rows["lower"], rows["upper"]))
        numbers = f"{len(rows)} | {error:.3g} | {before:.3g} | {bias:.3g} | {100 * held:.0f} %"
        lines.append(f"| {kind} | {numbers} | {histogram(rows['rank'])} |")
    muscle = table[table["parameter"].str.startswith("contractility") & table["identifiable"]]
    area = area_under_curve(-muscle["mean"].to_numpy(), (muscle["true"] < SCAR).to_numpy())
    scarred = muscle[muscle["true"] < SCAR]["scar_probability"]
    others = muscle[muscle["true"] >= SCAR]["scar_probability"]
    said = (
        f"{scarred.mean():.2f} in the {len(scarred)} that are one, and {others.mean():.2f} in the {len(others)} others"
    )
    return [
        *lines,
        "",
        f"Scarred segments among the identifiable ones: area under the ROC curve {area:.2f}; mean probability of",
        f"a scar {said}.",
        "",
    ]


def histogram(ranks: pd.Series) -> str:
    """Numbers of ranks in each fifth; a dash if there are no draws."""
    if ranks.isna().any():
        return "-"
    return " ".join(map(str, np.histogram(ranks, BINS, (0, 1))[0]))


def ranked(posterior: np.ndarray, true: float) -> float:
    """Rank of a true value among draws (n,); a half of those that are equal to it count."""
    return float(np.mean((posterior < true) + 0.5 * (posterior == true)))


def of_repository(folder: Path) -> tuple[pd.DataFrame, list[str]]:
    """Table of what was inferred, with ranks, and how far the tracked strain was off."""
    repository = et.Repository(folder)
    table, names, errors = inferred.table(repository), list(schema.LABELS["parameter"]), []
    for case in inferred.hearts(repository):
        posterior = repository.arrays("inference/posterior", case, None, "value")["value"][0].astype(float)
        of_case = table["case"] == case
        table.loc[of_case, "rank"] = [
            ranked(posterior[:, names.index(name)], true)
            for name, true in zip(table["parameter"][of_case], table["true"][of_case], strict=True)
        ]
        seen = repository.arrays("inference/observed_data", case)["value"]
        errors.append(seen - repository.arrays("inference/constant_data", case, None, "true_value")["true_value"])
    strains = np.array([not label.endswith("rotation") for label in schema.observations(repository.config)])
    off = 100 * np.sqrt(np.nanmean(np.array(errors)[:, strains] ** 2))
    return table, [f"Tracked strain less the tracker's bias was off by {off:.1f} percentage points, RMS.", ""]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", type=Path, nargs="+", help="repositories, or tables that echotruth infer wrote")
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    arguments = parser.parse_args()
    tables, strains = [], []
    for place in arguments.places:
        if place.suffix == ".csv":
            tables.append(pd.read_csv(place, usecols=list(inferred.COLUMNS)).assign(rank=np.nan))
        else:
            table, said = of_repository(place)
            tables.append(table)
            strains += said
    table = pd.concat(tables).dropna(subset="true")
    lines = []
    for (tracker, size), rows in table.groupby(["tracker", "size_px"]):
        lines += [f"## {tracker}, {size} px", "", *summary(rows)]
    lines += strains
    arguments.output.write_text(HEAD + "\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()

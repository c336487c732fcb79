"""How well the muscle of hearts is inferred: error, coverage and calibration on the hearts of config/inference.yaml.

    echotruth run config/inference.yaml
    python -m benchmarks.tracker_errors out/inference
    python benchmarks/inference.py out/inference --processes 2
    python benchmarks/inference.py out/hearts --processes 2 --motion tracked --size 512

Hearts whose label `split` is test are inferred from what the tracker saw, at every image size, with the errors of
`tracker_errors.csv`, in which they are not; with a prior of contractility as it was drawn; from how they truly moved,
with the error of the model's mesh alone: the difference is what the tracker costs; and by a model of another passive
law than theirs. Each takes one to four minutes; what is done is kept in results/inference.csv, and the same command
goes on with the rest. The page is results/inference.md.

The rank of a true value is the share of the draws of its posterior that are below it. If hearts were drawn from the
prior and the posteriors are right, ranks are uniform: as many in the first fifth as in each other (simulation-based
calibration, Talts 2018, arXiv:1804.06788).
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

import echotruth as et
from echotruth.inference.estimate import COVERED
from echotruth.inference.observation import dataset, loop_of, seen_of
from echotruth.inference.tracker_errors import TrackerError, acoustics
from echotruth.inference.truth import truth

RESULTS = Path(__file__).parent / "results"
TABLE, PAGE = RESULTS / "inference.csv", RESULTS / "inference.md"
TRACKED, DRAWN, TRUE, OTHER_LAW = "tracked", "drawn prior", "true", "another law"
TITLES = {
    TRACKED: "Tracked at",
    DRAWN: "With the prior of contractility that was drawn from, tracked at",
    TRUE: "True motion where the points are at",
    OTHER_LAW: "By a model of another law, tracked at",
}
LAW = "holzapfel_ogden"
"""That of the hearts is `fung`."""
PRIORS = {DRAWN: {"mechanics.regional.contractility": (1.0, 0.3)}}
"""Other priors than the default ones."""
NO_ERROR = TrackerError(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 6)
ABOUT = ["hearts", "motion", "size_px", "case"]
COLUMNS = [
    *ABOUT,
    *("parameter", "mean", "sd", "lower", "upper", "prior_mean", "prior_sd", "identifiable", "scar_probability"),
    *("true", "rank", "infarct", "misfit", "converged", "cpu_s"),
]
"""`infarct`: whether the segment is in one."""
BINS = 5
"""Of the histogram of ranks."""
MID = range(7, 13)
"""AHA segments of the middle level, 60 deg each, one after the other around the wall."""
HEAD = """# The muscle of hearts from what a tracker saw

Written by `benchmarks/inference.py`. Root mean square of the errors, the same of the means of the priors, mean of the
errors, the share of the 90 % intervals that hold the true value, and how many ranks of true values are in each fifth.
Pressures and volumes of the loop are found as they were given; inference.csv has them.

"""


class Observed(NamedTuple):
    """What is inferred from.

    Attributes
    ----------
    hearts : str
        Name of their repository and what their images are.
    motion : {"tracked", "drawn prior", "true", "another law"}
    size_px : int
    case : str
    seen : Dataset
    true : dict
        Values of the parameters.
    infarct : list of int
        Its segments.
    """

    hearts: str
    motion: str
    size_px: int
    case: str
    seen: xr.Dataset
    true: dict[str, float]
    infarct: list[int]


def observed(repository: et.Repository, tracker: str, motions: list[str], sizes: list[int]) -> Iterator[Observed]:
    """What is inferred from: largest images first, then true motion, then the smaller ones."""
    test = [case for case in repository.every.values() if case.labels.get("split") == "test"]
    group = f"tracking/{tracker}"
    cases = [case for case in test if not any(repository.problem(case.id, view, group) for view in repository.views)]
    print(f"{len(cases)} of {len(test)} cases were imaged and tracked", flush=True)
    about = {case.id: (truth(repository, case.id), case.config.pathology.infarct.segments or []) for case in cases}
    largest, *others = repository.sizes
    makers = {TRACKED: et.observe, DRAWN: et.observe, TRUE: moved, OTHER_LAW: of_another_law}
    groups = [*((motion, largest) for motion in makers), *((TRACKED, size) for size in others)]
    for motion, size in groups:
        if motion not in motions or size not in sizes:
            continue
        for case in cases:
            hearts = f"{repository.config.name} ({acoustics(case.config)})"
            try:
                seen = makers[motion](repository, tracker, case.id, size)
            except ValueError as error:
                print(f"left out: {error}", flush=True)
                continue
            yield Observed(hearts, motion, size, case.id, seen, *about[case.id])


def of_another_law(repository: et.Repository, tracker: str, case: str, size: int) -> xr.Dataset:
    """What a tracker saw, for a model with the passive law that the heart has not."""
    seen = et.observe(repository, tracker, case, size)
    config = et.configure(json.loads(seen.attrs["config"]), mechanics={"material": {"law": LAW}})
    return seen.assign_attrs(config=config.model_dump_json())


def moved(repository: et.Repository, tracker: str, case: str, size: int) -> xr.Dataset:
    """How a heart truly moved where a tracker saw it, with the error of the model alone."""
    heart = repository.case(case)
    seen = [one._replace(tracked=one.true) for one in seen_of(repository, heart, tracker, size) if one.segments]
    about = {"case": case, "tracker": TRUE, "size_px": size, "acoustics": "none"}
    loop = loop_of(repository, heart)
    return dataset([(one, NO_ERROR) for one in seen], heart.config.model_dump_json(), loop, about)


def inferred(given: Observed) -> pd.DataFrame:
    """Rows of one heart."""
    begun = time.process_time()
    found = et.infer(given.seen, PRIORS.get(given.motion), progress=False)
    spent = time.process_time() - begun
    names = [str(name) for name in found["parameter"].values]
    true = np.array([given.true.get(name, np.nan) for name in names])
    segments = [int(number) if name == "contractility" else 0 for name, _, number in (n.partition(".") for n in names)]
    scars = {
        int(aha): float(value) for aha, value in zip(found["aha"].values, found["scar_probability"].values, strict=True)
    }
    table = (
        found.drop_dims(["observation", "draw", "aha"])
        .to_dataframe()
        .reset_index()
        .assign(
            hearts=given.hearts,
            motion=given.motion,
            size_px=given.size_px,
            case=given.case,
            true=true,
            rank=ranks(found["posterior"].values, true),
            scar_probability=[scars.get(number, np.nan) for number in segments],
            infarct=[number in given.infarct for number in segments],
            misfit=bool(found.attrs["misfit"]),
            converged=bool(found.attrs["converged"]),
            cpu_s=spent,
        )
    )
    return table[COLUMNS]


def ranks(posterior: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Ranks (parameter,) of true values among draws (draw, parameter); a half of those that are equal count."""
    return np.mean((posterior < true) + 0.5 * (posterior == true), axis=0)


def rank_counts(rows: pd.DataFrame) -> str:
    """How many ranks are in each bin of the histogram."""
    return " ".join(map(str, np.histogram(rows["rank"], BINS, (0, 1))[0]))


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


def azimuth_error(rows: pd.DataFrame) -> float:
    """Angle between where the middle level of a heart contracts least, and the middle of its infarct, deg.

    Where it contracts least is the direction of sum((1 - c_s) e^(i theta_s)).
    """
    places = {f"contractility.{number}": np.exp(1j * np.pi / 3 * (number - MID[0])) for number in MID}
    rows = rows[rows["parameter"].isin(list(places))]
    direction = rows["parameter"].map(places).to_numpy()
    weak, infarct = np.sum((1 - rows["mean"].to_numpy()) * direction), np.sum(direction[rows["infarct"].to_numpy()])
    return float(np.degrees(abs(np.angle(weak / infarct))))


def summary(table: pd.DataFrame) -> list[str]:
    """Lines of one motion and size."""
    hearts = table.drop_duplicates("case")
    seconds = np.percentile(hearts["cpu_s"], [10, 50, 90])
    lines = [
        f"{len(hearts)} hearts; {hearts['misfit'].sum()} with a misfit, {(~hearts['converged']).sum()} not converged."
        f" {flagged(table)}",
        "CPU time of a heart, 10th, 50th and 90th percentile: "
        + ", ".join(f"{value:.0f}" for value in seconds)
        + " s.",
        "",
    ]
    head = ("parameter", "number", "RMS error", "of the prior", "mean error", "90 % intervals that hold", "ranks")
    lines += [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for kind, rows in table.groupby(kinds(table), sort=False):
        error, before = (np.sqrt(np.mean((rows[name] - rows["true"]) ** 2)) for name in ("mean", "prior_mean"))
        bias, held = np.mean(rows["mean"] - rows["true"]), np.mean(rows["true"].between(rows["lower"], rows["upper"]))
        lines.append(
            f"| {kind} | {len(rows)} | {error:.3g} | {before:.3g} | {bias:.3g} | {100 * held:.0f} % |"
            f" {rank_counts(rows)} |"
        )
    return [*lines, "", *scars(table), ""]


def flagged(table: pd.DataFrame) -> str:
    """Sentence on the hearts in which more intervals of contractility fail than one in ten."""
    muscle = table[table["parameter"].str.startswith("contractility") & table["identifiable"]]
    failed = ~muscle["true"].between(muscle["lower"], muscle["upper"])
    hearts = muscle.assign(failed=failed).groupby("case").agg({"failed": "mean", "misfit": "first"})
    wrong = hearts[hearts["failed"] > 1 - COVERED]
    count = f"{len(wrong)}, {wrong['misfit'].sum()} of them with a misfit."
    return f"More than a tenth of the intervals of contractility fail in {count}"


def scars(table: pd.DataFrame) -> list[str]:
    """Lines on the infarcts."""
    muscle = table[table["parameter"].str.startswith("contractility") & table["identifiable"]]
    if not muscle["infarct"].any():
        return [f"No identifiable segment is in an infarct. {of_scars(muscle)}"]
    area = area_under_curve(-muscle["mean"].to_numpy(), muscle["infarct"].to_numpy())
    of_infarct, others = (muscle[muscle["infarct"] == there] for there in (True, False))
    rms = [np.sqrt(np.mean((rows["mean"] - rows["true"]) ** 2)) for rows in (of_infarct, others)]
    bias = [np.mean(rows["mean"] - rows["true"]) for rows in (of_infarct, others)]
    likely = [rows["scar_probability"].mean() for rows in (of_infarct, others)]
    held = [100 * rows["true"].between(rows["lower"], rows["upper"]).mean() for rows in (of_infarct, others)]
    ill = table[table["case"].isin(of_infarct["case"])]
    angles = [azimuth_error(rows) for _, rows in ill.groupby("case")]
    return [
        f"Identifiable segments in an infarct ({len(of_infarct)}) and others ({len(others)}): RMS error of their"
        f" contractility {rms[0]:.2f} and {rms[1]:.2f}, mean error {bias[0]:.2f} and {bias[1]:.2f},"
        f" intervals that hold {held[0]:.0f} and {held[1]:.0f} %, mean"
        f" probability of a scar {likely[0]:.2f} and {likely[1]:.2f}; area under the ROC curve {area:.3f}. Azimuth of"
        f" the infarct: off by {np.median(angles):.0f} deg in the median, {np.percentile(angles, 90):.0f} deg in the"
        f" 90th percentile of {len(angles)} hearts. Ranks in an infarct: {rank_counts(of_infarct)}. {of_scars(muscle)}",
    ]


def of_scars(muscle: pd.DataFrame) -> str:
    """Sentence on how many of the segments with a probability of a scar are in one."""
    counts = []
    for low, high in itertools.pairwise((0.02, 0.2, 0.5, 0.8, 1.001)):
        inside = muscle[muscle["scar_probability"].between(low, high, inclusive="left")]
        counts.append(f"{inside['infarct'].sum()} of {len(inside)} at {low:g} to {min(high, 1):g}")
    return f"In an infarct are, by the probability of a scar, {', '.join(counts)}."


def report(table: pd.DataFrame) -> str:
    """The page."""
    lines = []
    muscle = table[~table["parameter"].str.startswith("loop.")]
    for (hearts, motion, size), rows in muscle.groupby(["hearts", "motion", "size_px"], sort=False):
        lines += [f"## {TITLES[motion]} {size} px: {hearts}", "", *summary(rows)]
    return HEAD + "\n".join(lines)


def infer_all(left: list[Observed], processes: int, output: Path) -> None:
    """Infer hearts, and add the rows of each to a table as soon as they are there."""
    with ProcessPoolExecutor(processes) as pool:
        jobs = {pool.submit(inferred, one): one for one in left}
        for number, job in enumerate(as_completed(jobs), 1):
            name = " ".join(map(str, jobs[job][: len(ABOUT)]))
            try:
                rows = job.result()
            except (ValueError, RuntimeError) as error:
                print(f"{number} of {len(left)}, {name}: left out: {error}", flush=True)
                continue
            rows.to_csv(output, mode="a", header=not output.is_file(), index=False, float_format="%.6g")
            print(f"{number} of {len(left)}, {name}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path)
    parser.add_argument("--tracker", default="bspline_dic")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--motion", choices=list(TITLES), action="append", help="can be repeated (default: all)")
    parser.add_argument("--size", type=int, action="append", help="image size, px; can be repeated (default: all)")
    parser.add_argument("-o", "--output", type=Path, default=TABLE, help="table of what is done")
    arguments = parser.parse_args()
    table = pd.read_csv(arguments.output) if arguments.output.is_file() else pd.DataFrame(columns=COLUMNS)
    done = set(table[ABOUT].itertuples(index=False, name=None))
    repository = et.Repository(arguments.repository)
    motions, sizes = arguments.motion or list(TITLES), arguments.size or repository.sizes
    wanted = observed(repository, arguments.tracker, motions, sizes)
    left = [one for one in wanted if one[: len(ABOUT)] not in done]
    infer_all(left, arguments.processes, arguments.output)
    table = pd.read_csv(arguments.output).sort_values(ABOUT, ascending=[False, True, False, True])
    PAGE.write_text(report(table.dropna(subset="true")))
    print(PAGE.read_text())


if __name__ == "__main__":
    main()

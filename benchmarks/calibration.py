"""Whether the quality of trackers is the probability that it states, and the constants that make it so.

    python benchmarks/calibration.py out/benchmark --fit --hearts 6   # on hearts whose label split is develop
    python benchmarks/calibration.py out/benchmark                    # what the quality is worth on those of test

`--fit` tracks clips anew and fits the constants of `ERRORS` in src/echotruth/tracking/quality.py: by maximum likelihood
of whether the points are within 1/256 of the side of the image of their true places. Every clip counts alike. The
constants are printed, as they stand in the package; after they are changed, the clips of the repository are tracked
anew (`echotruth run`). Without `--fit` the quality in the repository is held against the truth. The results are
results/calibration.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import astuple, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import report
from scipy.optimize import minimize
from suite import reliability
from suite.splits import DEVELOP, TEST, split_of, split_of_label

from echotruth.cases import Case, expand
from echotruth.config.loading import load
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.scoring import read_truth
from echotruth.repository.reader import Repository
from echotruth.section import Section
from echotruth.tracking import accumulation, quality
from echotruth.tracking.tracker import tracked_path
from echotruth.tracking.tracker_input import TrackerInput

RESULTS = Path(__file__).parent / "results"
EVERY = 7
"""Every n-th value of a clip is used; neighbours in time and place hardly differ."""
START, LOWEST, HIGHEST = (0.3, 0.2, 0.3, 0.3, 0.3, 0.05), 1e-3, 50.0
"""Constants at which the fit starts, in the order of `ErrorModel`, and their bounds."""
NEGLIGIBLE = 2e-3
SURE = 1e-6
"""Distance of a probability from 0 and 1, lest one point outweighs all others."""


class Samples(NamedTuple):
    """What a tracker can tell of its points, and whether they are near their true places.

    Attributes
    ----------
    pixel, variance, disagreement, displacement : ndarray of shape (n,)
        Arguments of `ErrorModel.variance`.
    near : ndarray of shape (n,), bool
    weight : ndarray of shape (n,)
        Every clip has the same sum.
    """

    pixel: np.ndarray
    variance: np.ndarray
    disagreement: np.ndarray
    displacement: np.ndarray
    near: np.ndarray
    weight: np.ndarray


def tracked(clip: Clip, settings: Section) -> accumulation.Path:
    """Path of the points of a clip."""
    return tracked_path(TrackerInput(*clip.tracker_arguments), settings)


def samples(clip: Clip, true: np.ndarray, path: accumulation.Path) -> Samples:
    """Samples of a clip with the true displacement (frame, n, 2), m."""
    unit = 1 / (quality.IMAGE_FRACTION * clip.size)
    error = np.hypot(*np.moveaxis(path.displacement - true / clip.spacing, -1, 0))
    known = np.isfinite(error) & np.isfinite(path.variance)
    known[0] = False
    displacement = np.hypot(*np.moveaxis(path.displacement, -1, 0))
    lengths = (unit * each[known][::EVERY] for each in (path.disagreement, displacement, error))
    disagreement, displacement, error = lengths
    count = len(error)
    variance = path.variance[known][::EVERY]
    weight = np.full(count, 1 / max(count, 1))
    return Samples(np.full(count, unit), variance, disagreement, displacement, error < 1, weight)


def gathered(
    folder: Path, cases: list[Case], sizes: list[int] | None, trackers: list[str] | None
) -> dict[str, list[Samples]]:
    """Samples of every clip of the cases that has images, by the name of the constants."""
    found: dict[str, list[Samples]] = {}
    for case in cases:
        repository = Repository(folder)
        for view in ready(repository, case):
            true = read_truth(repository, case.id, view).displacement
            for size, clip in read_clips(repository, case.id, view).items():
                for name, tracker in case.config.tracking.trackers.items():
                    chosen = size in (sizes or [size]) and name in (trackers or [name])
                    if tracker.method == "external" or not chosen:
                        continue
                    one = samples(clip, true, tracked(clip, tracker))
                    found.setdefault(quality.error_name(tracker), []).append(one)
            print(case.id, view, flush=True)
    return found


def ready(repository: Repository, case: Case) -> Iterator[str]:
    """Views of a case that have images."""
    for view in case.config.views:
        if not repository.problem(case.id, view, "truth", "bmode"):
            yield view


def fitted(given: list[Samples]) -> quality.ErrorModel:
    """Constants of the greatest likelihood; those that are negligible are 0."""
    pooled = Samples(*(np.concatenate(values) for values in zip(*given, strict=True)))

    def loss(logarithms: np.ndarray) -> float:
        model = quality.ErrorModel(*np.exp(logarithms))
        stated = quality.within(1.0, model.variance(*pooled[:4]))
        stated = np.clip(stated, SURE, 1 - SURE)
        return float(-np.average(np.where(pooled.near, np.log(stated), np.log1p(-stated)), weights=pooled.weight))

    bounds = [(np.log(LOWEST), np.log(HIGHEST))] * len(START)
    best = np.exp(minimize(loss, np.log(START), method="L-BFGS-B", bounds=bounds).x)
    if not np.isfinite(pooled.disagreement).any():
        best[4] = 0.0
    return quality.ErrorModel(*(float(f"{value:.3g}") if value > NEGLIGIBLE else 0.0 for value in best))


def spread(cases: list[Case], hearts: int | None) -> list[Case]:
    """Cases of the hearts of develop, of `hearts` of them evenly over the table."""
    develop = [case for case in cases if split_of(case) == DEVELOP]
    names = list(dict.fromkeys(str(case.labels.get("heart", case.id)) for case in develop))
    chosen = names if hearts is None else [names[k] for k in np.linspace(0, len(names) - 1, hearts).round().astype(int)]
    return [case for case in develop if str(case.labels.get("heart", case.id)) in chosen]


def table(folder: Path) -> list[str]:
    """Reliability of the quality in a repository, by tracker and image size, over the hearts of test."""
    found = Repository(folder).metrics().reliability
    found = found[found["split"].map(split_of_label) == TEST]
    if found.empty:
        raise SystemExit(f"{folder}: no heart of test is evaluated: run it to its end")
    steps = sorted(found["quality_low"].unique())
    head = ["tracker", "px", "error, %", *(f"{100 * low:.0f}-{100 * low + 10:.0f}" for low in steps)]
    rows = []
    for (tracker, size), one in found.groupby(["tracker", "size_px"], sort=False):
        curve = reliability.curve(one).set_index("quality_low")
        cells = [_cell(curve.loc[low], curve["count"].sum()) for low in steps]
        rows.append([tracker, size, f"{reliability.calibration_error(one):.1f}", *cells])
    return report.table(head, rows)


def _cell(step, total: float) -> str:
    """Share of points that are near, %; nothing where fewer than one in a thousand have such a quality."""
    return f"{step['observed_percent']:.0f}" if step["count"] > 1e-3 * total else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository, as out/benchmark")
    parser.add_argument("--fit", action="store_true", help="fit the constants on the hearts of develop")
    parser.add_argument("--hearts", type=int, help="number of hearts of the fit (default: all of develop)")
    parser.add_argument("--size", type=int, action="append", help="image size of the fit, px; can be repeated")
    parser.add_argument("--tracker", action="append", help="tracker of the fit; can be repeated (default: all)")
    given = parser.parse_args()
    folder = given.repository
    if given.fit:
        cases = expand(load(folder / "config.yaml"), str(folder / "config.yaml"))
        chosen = spread(list(cases), given.hearts)
        if not chosen:
            raise SystemExit(f"{folder}: no heart has the label split develop: give those to be tuned on this label")
        for name, clips_of_it in gathered(folder, chosen, given.size, given.tracker).items():
            kept = quality.ERRORS[name].unseen  # benchmarks/shadow.py fits it
            constants = ", ".join(f"{value:g}" for value in astuple(replace(fitted(clips_of_it), unseen=kept)))
            print(f'    "{name}": ErrorModel({constants}),', flush=True)
        return
    text = ["# Is the quality the probability that it states?", ""]
    text += [
        "Of the points with a stated quality from 0-10 to 90-100 %: the share (%) that is within 1/256 of the side of",
        "the image of its true place, on hearts on which nothing was fitted; before it the expected calibration error.",
        "",
    ]
    (RESULTS / "calibration.md").write_text("\n".join([*text, *table(folder), ""]))


if __name__ == "__main__":
    main()

"""Whether the quality of trackers is the probability that it states, and the constants that make it so.

    python benchmarks/quality.py out/A out/B --fit   # constants of `ERRORS` in src/echotruth/tracking/quality.py
    python benchmarks/quality.py out/A out/B         # results/quality.md: what the quality is worth on other hearts

Clips are tracked anew: as they are, with every second frame (`low rate`), and with noise in place of the image in a
sector of ten degrees (`noise`), whose points count. The fit is of the hearts whose label `split` is develop, by maximum
likelihood of whether points are within 1/256 of the side of the image of their true places; every clip counts alike.
The page is of all other hearts. A condition is the label `condition` of a case.
"""

import argparse
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields, replace
from itertools import product
from pathlib import Path

import numpy as np
import report
from noise_sector import CENTRE_DEG, shadowed
from scipy import ndimage
from scipy.optimize import minimize

from echotruth.cases import Case
from echotruth.config.tracking import OUTSIDE
from echotruth.evaluation.clip import read_clips
from echotruth.evaluation.scoring import read_truth
from echotruth.repository.reader import Repository
from echotruth.tracking import accumulation, quality
from echotruth.tracking.speckle import speckle_length
from echotruth.tracking.tracker import tracked_path
from echotruth.tracking.tracker_input import TrackerInput

RESULTS = Path(__file__).parent / "results" / "quality.md"
EVERY = 13
"""Every n-th value of a clip is used; neighbours in time and place hardly differ."""
START, LOWEST, HIGHEST = (0.2, 4.0, 0.2, 0.2, 0.04, 0.1), 1e-3, 50.0
"""Constants at which the fit starts, in the order of `ErrorModel`, and their bounds."""
NAMES = tuple(each.name for each in fields(quality.ErrorModel))
NEGLIGIBLE = 2e-3
SURE = 1e-6
"""Distance of a probability from 0 and 1, lest one point outweighs all others."""


@dataclass(frozen=True)
class Sample:
    """What a tracker tells of the points of a clip, and whether they are near their true places."""

    condition: str
    view: str
    size: int
    tracker: str
    terms: quality.Squares
    near: np.ndarray


def sample(where: tuple[str, str, int, str], speckle: float, path: accumulation.Path, true: np.ndarray, counts):
    """Sample of a tracked clip; `where` are the first fields, `true` is the displacement (frame, n, 2), px."""
    error = np.hypot(*np.moveaxis(path.displacement - true, -1, 0)) / (quality.IMAGE_FRACTION * where[2])
    chosen = np.isfinite(error) & counts
    chosen[0] = False
    terms = quality.squares(path, speckle, (where[2], where[2]))
    values = (np.broadcast_to(getattr(terms, each.name), error.shape)[chosen][::EVERY] for each in fields(terms))
    return Sample(*where, quality.Squares(*values), error[chosen][::EVERY] < 1)


def samples(folder: str, split: str) -> Iterator[Sample]:
    """Samples of the clips of a repository whose hearts are in a split, develop or test."""
    repository = Repository(folder)
    for name in repository.cases.index:
        case = repository.case(name)
        if (case.labels.get("split") == "develop") != (split == "develop"):
            continue
        for view in case.config.views:
            if not repository.problem(name, view, "truth", "bmode"):
                yield from samples_of_view(repository, case, view)


def samples_of_view(repository: Repository, case: Case, view: str) -> Iterator[Sample]:
    """Samples of the clips of one view of a case, in three conditions."""
    true, plane = read_truth(repository, case.id, view).displacement, case.config.views[view].plane
    condition = str(case.labels.get("condition", "plain"))
    trackers = [tracker for tracker in case.config.tracking.trackers.values() if not isinstance(tracker, OUTSIDE)]
    for size, clip in read_clips(repository, case.id, view).items():
        displacement, speckle = true / clip.spacing, speckle_length(clip.frames[0], clip.mask)
        noisy, inside = shadowed(clip.frames, CENTRE_DEG[plane])
        place = np.moveaxis(clip.points + displacement, -1, 0)[::-1]
        hidden = ndimage.map_coordinates(inside, place, order=1, mode="nearest") > 0.5
        every = np.ones_like(hidden)
        ways = (condition, clip.frames, 1, every), ("low rate", clip.frames, 2, every), ("noise", noisy, 1, hidden)
        for tracker, (name, frames, step, counts) in product(trackers, ways):
            given = frames[::step], *clip.tracker_arguments[1:4], clip.frame_time[::step], clip.seed
            path = tracked_path(TrackerInput(*given), tracker)
            where = name, plane, size, quality.error_name(tracker)
            yield sample(where, speckle, path, displacement[::step], counts[::step])


def fitted(given: list[Sample]) -> quality.ErrorModel:
    """Constants of clips without noise; the last one, `unseen`, of clips in which a tracker finds tissue hidden."""
    hidden = [one for one in given if one.terms.unseen.any()]
    clear = [one for one in given if one.condition != "noise" and len(one.near)]
    model = likeliest(clear, quality.ErrorModel(*START), NAMES)
    return likeliest(hidden, model, NAMES[-1:]) if hidden else replace(model, unseen=0.0)


def likeliest(given: list[Sample], start: quality.ErrorModel, names: tuple[str, ...]) -> quality.ErrorModel:
    """Constants of these names with the greatest likelihood; those that are negligible are 0."""
    columns = ([getattr(one.terms, each.name) for one in given] for each in fields(quality.Squares))
    terms, near = quality.Squares(*map(np.concatenate, columns)), np.concatenate([one.near for one in given])
    weight = np.concatenate([np.full(len(one.near), 1 / len(one.near)) for one in given])

    def loss(logarithms: np.ndarray) -> float:
        model = replace(start, **dict(zip(names, np.exp(logarithms), strict=True)))
        stated = np.clip(quality.within(1.0, model.variance(terms)), SURE, 1 - SURE)
        return float(-np.average(np.where(near, np.log(stated), np.log1p(-stated)), weights=weight))

    begin, bounds = [np.log(getattr(start, name)) for name in names], [(np.log(LOWEST), np.log(HIGHEST))] * len(names)
    best = np.exp(minimize(loss, begin, method="L-BFGS-B", bounds=bounds).x)
    idle = () if terms.disagreement.any() else ("disagreement", "wall")
    kept = {name: value * (value > NEGLIGIBLE and name not in idle) for name, value in zip(names, best, strict=True)}
    return replace(start, **{name: float(f"{value:.3g}") for name, value in kept.items()})


def page(given: list[Sample]) -> list[str]:
    """Clips, and the shares of points that are stated to be near and are, %, by tracker, condition, view and size."""
    rows = []
    for key in dict.fromkeys((one.tracker, one.condition, one.view, one.size) for one in given):
        some = [one for one in given if (one.tracker, one.condition, one.view, one.size) == key and len(one.near)]
        model = quality.ERRORS[key[0]]
        stated = np.mean([quality.within(1.0, model.variance(one.terms)).mean() for one in some])
        rows.append([*key, len(some), f"{100 * stated:.0f}", f"{100 * np.mean([one.near.mean() for one in some]):.0f}"])
    return report.table(["tracker", "condition", "view", "px", "clips", "stated, %", "right, %"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", nargs="+", help="folder of a repository")
    parser.add_argument("--fit", action="store_true", help="fit the constants on the hearts of develop")
    given = parser.parse_args()
    found = [one for folder in given.repository for one in samples(folder, "develop" if given.fit else "test")]
    if not given.fit:
        RESULTS.write_text("\n".join(["# Is the quality the probability that it states?", "", *page(found), ""]))
    for name in dict.fromkeys(one.tracker for one in found) if given.fit else ():
        constants = fitted([one for one in found if one.tracker == name])
        print(f'    "{name}": ErrorModel({", ".join(map(str, astuple(constants)))}),')


if __name__ == "__main__":
    main()

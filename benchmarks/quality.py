"""Constants that make the quality of trackers the probability that it states.

    python benchmarks/quality.py out/learning out/learning_human out/learning_ideal
    python benchmarks/quality.py      # factors of all but `limit`, by the half develop of the suite

Every seventh heart of the repositories counts, of config/learning.yaml, learning_human.yaml and learning_ideal.yaml.
Their clips are tracked anew: as they are, with every second frame, and, by trackers that find hidden tissue, with noise
in place of the image in a sector of ten degrees, whose points count. The fit is by maximum likelihood of whether points
are within 1/256 of the side of the image of their true places; every clip counts alike. These hearts are drawn further
from the presets than those that users begin with, so that the constants are then multiplied by one factor of each
tracker: that at which the realistic clips of the half develop are right as often as stated, in parts 1 and 2 made with
the constants as they were. The result is `ERRORS` in src/echotruth/tracking/quality.py; all parts are then made anew.
The half test of the suite (docs/benchmark.md) says how well it holds.
"""

import argparse
import os
from dataclasses import astuple, dataclass, fields, replace

import numpy as np
import pandas as pd
from noise_sector import CENTRE_DEG, shadowed
from scipy import ndimage
from scipy.optimize import brentq, minimize
from suite import columns, hearts, parts

import echotruth as et
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.parallel import in_processes
from echotruth.evaluation.scoring import read_truth
from echotruth.repository.reader import Repository
from echotruth.tracking import quality
from echotruth.tracking.speckle import speckle_length
from echotruth.tracking.tracker import tracked_path
from echotruth.tracking.tracker_input import TrackerInput

OTHERS = {"ilk": {"method": "ilk"}}
"""Trackers beside those of the suite. The network of `bspline_cnn` tells its own deviation."""
EVERY_HEART = 7
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

    tracker: str
    clip: tuple[str, int, str]
    terms: quality.Squares
    near: np.ndarray


def sample(
    settings, view: str, clip: Clip, true: np.ndarray, way: str, frames: np.ndarray, step: int, counts: np.ndarray
):
    """Sample of a clip of true displacement, px, from every or every second of the given frames."""
    given = TrackerInput(frames[::step], *clip.tracker_arguments[1:4], clip.frame_time[::step], clip.seed)
    path, side = tracked_path(given, settings), frames.shape[-1]
    error = np.hypot(*np.moveaxis(path.displacement - true[::step], -1, 0)) / (quality.IMAGE_FRACTION * side)
    chosen = np.isfinite(error) & counts[::step]
    chosen[0] = False
    terms = quality.squares(path, speckle_length(clip.frames[0], clip.mask), (side, side))
    values = (np.broadcast_to(getattr(terms, each.name), error.shape)[chosen][::EVERY] for each in fields(terms))
    return Sample(quality.error_name(settings), (view, side, way), quality.Squares(*values), error[chosen][::EVERY] < 1)


def samples(place: tuple[str, str]) -> list[Sample]:
    """Samples of the clips of a case, given with the folder of its repository."""
    folder, case = place
    repository, found = Repository(folder), []
    config = repository.case(case).config
    trackers = {name: settings for name, settings in hearts.TRACKERS.items() if name != "bspline_cnn"} | OTHERS
    trackers["corrected"] = trackers["corrected"] | {"window_mm": config.bmode.field_of_view_mm / 8}
    config = et.configure(config, tracking={"trackers": trackers})
    for view in config.views:
        true = read_truth(repository, case, view).displacement
        for clip in read_clips(repository, case, view).values():
            displacement = true / clip.spacing
            noisy, inside = shadowed(clip.frames, CENTRE_DEG[config.views[view].plane])
            place = np.moveaxis(clip.points + displacement, -1, 0)[::-1]
            hidden = ndimage.map_coordinates(inside, place, order=1, mode="nearest") > 0.5
            every = np.ones_like(hidden)
            for settings in config.tracking.trackers.values():
                ways = [("plain", clip.frames, 1, every), ("low rate", clip.frames, 2, every)]
                ways += [("noise", noisy, 1, hidden)] * (settings.method == "bspline_dic")
                found += [sample(settings, view, clip, displacement, *way) for way in ways]
    return [one for one in found if len(one.near)]


def fitted(given: list[Sample]) -> quality.ErrorModel:
    """Constants of clips without noise; the last one, `unseen`, of clips in which a tracker finds tissue hidden."""
    hidden = [one for one in given if one.terms.unseen.any()]
    clear = [one for one in given if one.clip[2] != "noise"]
    model = likeliest(clear, quality.ErrorModel(*START), NAMES)
    return likeliest(hidden, model, NAMES[-1:]) if hidden else replace(model, unseen=0.0)


def likeliest(given: list[Sample], start: quality.ErrorModel, names: tuple[str, ...]) -> quality.ErrorModel:
    """Constants of these names with the greatest likelihood; those that are negligible are 0."""
    values = ([getattr(one.terms, each.name) for one in given] for each in fields(quality.Squares))
    terms, near = quality.Squares(*map(np.concatenate, values)), np.concatenate([one.near for one in given])
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


def factor_of(clips: pd.DataFrame) -> float:
    """Factor of the deviations of a tracker with which it is right as often as it states, in the mean over clips."""
    steps = columns.reliability(clips).query("count > 0")
    share = 1 / steps.groupby(["case", "view", "size_px"])["count"].transform("sum")
    stated = np.clip(steps["quality_sum"] / steps["count"], SURE, 1 - SURE)

    def excess(factor: float) -> float:
        changed = 1 - (1 - stated) ** factor**-2
        return float((share * (changed * steps["count"] - steps["within_count"])).sum())

    return float(brentq(excess, 0.1, 10))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", nargs="*", help="folder of a repository")
    given = parser.parse_args()
    if not given.repository:
        develop = parts.read_parts().query("split == 'develop' and acoustics == 'realistic'")
        if develop.empty:
            parser.error("there are no parts of the half develop: make parts 1 and 2 of the suite first")
        trackers = hearts.cases_of(hearts.plan()[0], 1)[0].case.config.tracking.trackers
        names = {name: quality.error_name(settings) for name, settings in trackers.items()}
        for name, clips in develop.groupby("tracker"):
            print(f"{names.get(name, name)}: {factor_of(clips):.2f}")
        return
    cases = [
        (folder, case)
        for folder in given.repository
        for case in Repository(folder).cases.query("status == 'complete'").index
    ]
    chosen, found = cases[::EVERY_HEART], []
    for number, of_case in enumerate(in_processes(samples, chosen, os.cpu_count() or 1), 1):
        found += of_case
        print(f"{number} of {len(chosen)} hearts", flush=True)
    for name in dict.fromkeys(one.tracker for one in found):
        model = fitted([one for one in found if one.tracker == name])
        print(f'    "{name}": ErrorModel({", ".join(map(str, astuple(model)))}),')
        for clip in sorted({one.clip for one in found if one.tracker == name}):
            some = [one for one in found if (one.tracker, one.clip) == (name, clip)]
            stated = np.mean([quality.within(1.0, model.variance(one.terms)).mean() for one in some])
            right = np.mean([one.near.mean() for one in some])
            print(f"    # {clip}: {100 * stated:.0f} % stated, {100 * right:.0f} % right")


if __name__ == "__main__":
    main()

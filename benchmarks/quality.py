"""Constants that make the quality of trackers the probability that it states.

    python -m benchmarks.quality
    python -m benchmarks.quality volumes    # of bspline_dic in volumes, on hearts of benchmarks/volumes.py

The hearts are those of the half develop of the suite (benchmarks/suite/hearts.py), whose half test says how well the
quality holds. Their clips are tracked as they are and, by trackers that find hidden tissue, with noise in place of the
image in a sector of ten degrees, whose points count. The fit is by maximum likelihood of whether points are within
1/256 of the side of the image of their true places; every clip counts alike. The result is `ERRORS` in
src/echotruth/tracking/quality.py. It takes three quarters of an hour on two cores, and of volumes ten minutes.
"""

import argparse
import os
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, fields, replace

import numpy as np
from scipy import ndimage
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

import echotruth as et
from benchmarks.noise_sector import CENTRE_DEG, shadowed
from benchmarks.parallel import in_processes
from benchmarks.suite import hearts
from benchmarks.suite.scores import heart_views, view_clips
from benchmarks.volumes import FITTED, RADIUS, beating
from echotruth.config.tracking import OUTSIDE, BsplineDic
from echotruth.evaluation.clip import Clip
from echotruth.evaluation.volume import VolumePoints
from echotruth.notebook.volume import volume_clip
from echotruth.repository.datasets import imaged_heart
from echotruth.tracking import quality
from echotruth.tracking.speckle import speckle_length
from echotruth.tracking.tracker import tracked_path
from echotruth.tracking.tracker_input import TrackerInput

FIND_HIDDEN = ("bspline_dic", "bspline_cnn")
EVERY = 13
"""Every n-th value of a clip is used; neighbours in time and place hardly differ."""
START = quality.ErrorModel(0.2, 1.0, 0.2, 0.2, 0.04, 0.1, 0.5)
LOWEST, HIGHEST = 1e-3, 50.0
"""Constants at which the fit starts, and their bounds."""
NAMES = tuple(each.name for each in fields(quality.ErrorModel))
NEGLIGIBLE = 2e-3
SURE = 1e-6
"""Distance of a probability from 0 and 1, lest one point outweighs all others."""


@dataclass(frozen=True)
class Sample:
    """What a tracker says of the points of a clip, and whether they are near their true places.

    `clip` is the species, the view, the size and whether there is noise; of volumes species and diagnosis come first.
    """

    tracker: str
    clip: tuple[str, str, int, bool]
    terms: quality.Squares
    near: np.ndarray
    dimensions: int = 2

    def stated(self, model: quality.ErrorModel) -> np.ndarray:
        """Probability that each point is near."""
        return quality.within(1.0, model.variance(self.terms), self.dimensions)


def samples(row: Mapping[str, object]) -> list[Sample]:
    """Samples of the clips of a heart of the plan."""
    found = []
    with threadpool_limits(1):
        for _, one, heart, view in heart_views(row):
            config = one.case.config
            truth, _, clips = view_clips(one.case, heart, view)
            for clip in clips:
                true, sort = truth.displacement / clip.spacing, (str(row["species"]), view, clip.size)
                ours = [each for each in config.tracking.trackers.values() if not isinstance(each, OUTSIDE)]
                for settings in ours:
                    for noisy, values in _samples_of(clip, true, settings, CENTRE_DEG[config.views[view].plane]):
                        found.append(Sample(quality.error_name(settings), (*sort, noisy), *values))
    return [one for one in found if len(one.near)]


def _samples_of(clip: Clip, true: np.ndarray, settings, centre_deg: float) -> Iterator[tuple[bool, tuple]]:
    """Terms of points, and whether they are near, of a clip as it is and with noise in a sector; truth is in px."""
    every = np.ones(true.shape[:2], bool)
    yield False, _values(clip, true, settings, every)
    if settings.method in FIND_HIDDEN:
        frames, inside = shadowed(clip.frames, centre_deg)
        place = np.moveaxis(clip.points + true, -1, 0)[::-1]
        hidden = ndimage.map_coordinates(inside, place, order=1, mode="nearest") > 0.5
        yield True, _values(replace(clip, frames=frames), true, settings, hidden)


def _values(clip: Clip, true: np.ndarray, settings, counts: np.ndarray) -> tuple[quality.Squares, np.ndarray]:
    """Terms of some of the points that count (frame, n), and whether they are near."""
    step = slice(None, None, clip.frame_step)
    return _tracked_values(TrackerInput(*clip.tracker_arguments), true[step], settings, counts[step])


def volume_samples(row: tuple[str, int, dict]) -> list[Sample]:
    """Samples of the volumes of a heart: its diagnosis, seed, and keys."""
    diagnosis, seed, keys = row
    with threadpool_limits(1):
        heart = beating(seed, keys)
        clip = et.image(heart, "whole")
        volumes, settings = volume_clip(clip), BsplineDic()
        given = TrackerInput(*volumes.tracker_arguments)
        wall = VolumePoints(*imaged_heart(clip, heart), volumes.positions, RADIUS)
        true = wall.displacement[..., [0, 2, 1]] / np.min(given.spacing)
        values = _tracked_values(given, true, settings, np.ones(true.shape[:2], bool))
    name = quality.error_name(settings, is_volume=True)
    return [Sample(name, (f"mouse, {diagnosis}", "whole", volumes.size, False), *values, dimensions=3)]


def _tracked_values(
    given: TrackerInput, true: np.ndarray, settings, counts: np.ndarray
) -> tuple[quality.Squares, np.ndarray]:
    """As :func:`_values`, of a true displacement in the finest spacing (frame, n, 2 or 3)."""
    path = tracked_path(given, settings)
    error = np.linalg.norm(path.displacement - true, axis=-1) / (quality.IMAGE_FRACTION * given.side)
    chosen = np.isfinite(error) & counts
    chosen[0] = False
    terms = quality.squares(path, speckle_length(given.frames[0], given.mask, given.ratio), (given.side,))
    some = (np.broadcast_to(getattr(terms, each.name), error.shape)[chosen][::EVERY] for each in fields(terms))
    return quality.Squares(*some), error[chosen][::EVERY] < 1


def fitted(given: list[Sample]) -> quality.ErrorModel:
    """Constants of clips without noise; then `unseen`, of clips in which a tracker finds tissue hidden."""
    hidden = [one for one in given if one.terms.unseen.any()]
    clear = [one for one in given if not one.clip[-1]]
    model = likeliest(clear, START, NAMES)
    return likeliest(hidden, model, ("unseen",)) if hidden else replace(model, unseen=0.0)


def likeliest(given: list[Sample], start: quality.ErrorModel, names: tuple[str, ...]) -> quality.ErrorModel:
    """Constants of these names with the greatest likelihood; those that are negligible are 0."""
    values = ([getattr(one.terms, each.name) for one in given] for each in fields(quality.Squares))
    terms, near = quality.Squares(*map(np.concatenate, values)), np.concatenate([one.near for one in given])
    weight = np.concatenate([np.full(len(one.near), 1 / len(one.near)) for one in given])

    def loss(logarithms: np.ndarray) -> float:
        model = replace(start, **dict(zip(names, np.exp(logarithms), strict=True)))
        stated = np.clip(replace(given[0], terms=terms).stated(model), SURE, 1 - SURE)
        return float(-np.average(np.where(near, np.log(stated), np.log1p(-stated)), weights=weight))

    begin, bounds = [np.log(getattr(start, name)) for name in names], [(np.log(LOWEST), np.log(HIGHEST))] * len(names)
    best = np.exp(minimize(loss, begin, method="L-BFGS-B", bounds=bounds).x)
    idle = () if terms.disagreement.any() else ("disagreement", "wall")
    idle += () if terms.stated.any() else ("stated",)
    kept = {name: value * (value > NEGLIGIBLE and name not in idle) for name, value in zip(names, best, strict=True)}
    return replace(start, **{name: float(f"{value:.3g}") for name, value in kept.items()})


def report(found: list[Sample]) -> None:
    """Print the constants of each tracker, and what is then stated and right, by sort of clip."""
    for name in dict.fromkeys(one.tracker for one in found):
        of_tracker = [one for one in found if one.tracker == name]
        model = fitted(of_tracker)
        print(f'    "{name}": ErrorModel({", ".join(map(str, astuple(model)))}),')
        for clip in sorted({one.clip for one in of_tracker}):
            some = [one for one in of_tracker if one.clip == clip]
            stated = np.mean([one.stated(model).mean() for one in some])
            right = np.mean([one.near.mean() for one in some])
            print(f"    # {clip}: {100 * stated:.0f} % stated, {100 * right:.0f} % right, {len(some)} clips")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("volumes", nargs="?", choices=("volumes",), help="of volumes in place of clips")
    of_volumes = parser.parse_args().volumes is not None
    chosen, found = FITTED if of_volumes else hearts.plan(hearts.BLOCKS[:1]), []
    work = volume_samples if of_volumes else samples
    for number, of_heart in enumerate(in_processes(work, chosen, os.cpu_count() or 1), 1):
        found += of_heart
        print(f"{number} of {len(chosen)} hearts", flush=True)
    report(found)


if __name__ == "__main__":
    main()

"""How well tissue in and beside a shadow is tracked, and how sure the tracker is of it.

    python benchmarks/shadow.py out/NAME --fit d b  # the constant `unseen` of tracking/quality.py, of two hearts
    python benchmarks/shadow.py out/NAME a c        # the table of docs/tracking.md, of two others

`--regardless` tracks as if all were seen.

In the clips of a repository a sector of ten degrees about the probe is replaced: echoes are 40 dB weaker there, below
noise of the size of speckle, new in every frame, whose power is 35 dB below white. `bspline_dic` tracks the clips.
"""

import argparse
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.optimize import minimize_scalar

from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.scoring import read_truth
from echotruth.repository.reader import Repository
from echotruth.tracking import quality, visibility
from echotruth.tracking.tracker import tracked_path
from echotruth.tracking.tracker_input import TrackerInput

WIDTH_DEG, LOSS_DB, NOISE_DB, DYNAMIC_RANGE_DB = 10.0, 40.0, -35.0, 55.0
CENTRE_DEG = {"short_axis": -12.0, "long_axis": 8.0}
GRAIN = 1.2 / 512, 3.0 / 512
"""Standard deviation of the blur of the noise, axial and lateral, over the side of the image."""


class Sample(NamedTuple):
    """What was found in a clip with a shadow.

    NRMSE at end-systole, %, of points never in it and of those within; and of the latter in all frames the variance
    without and the squared part with the constant `unseen`, and whether they are near their true places.
    """

    beside: float
    within: float
    variance: np.ndarray
    extrapolated: np.ndarray
    near: np.ndarray


def shadowed(frames: np.ndarray, centre_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Clip (frame, axial, lateral) with a shadow, and how far each pixel is in it, (axial, lateral)."""
    size = frames.shape[-1]
    row, column = np.indices((size, size))
    angle = np.degrees(np.arctan2(column - (size - 1) / 2, row + 0.5))
    inside = 1 / (1 + np.exp((np.abs(angle - centre_deg) - WIDTH_DEG / 2) / 0.15))
    random = np.random.default_rng(0)
    blur = (0, *(max(0.5, share * size) for share in GRAIN))
    noise = np.array([np.hypot(*ndimage.gaussian_filter(random.normal(size=(2, size, size)), blur)) for _ in frames])
    noise *= 10 ** (NOISE_DB / 20) / np.sqrt(np.mean(noise**2))
    amplitude = np.where(frames > 0, 10 ** ((frames / 255 - 1) * DYNAMIC_RANGE_DB / 20), 0)
    seen = amplitude * 10 ** (-LOSS_DB / 20 * inside) + noise * inside
    grey = 255 * (1 + 20 * np.log10(np.maximum(seen, 1e-9)) / DYNAMIC_RANGE_DB)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8), inside


def sample(clip: Clip, true: np.ndarray, es: int, centre_deg: float) -> Sample:
    """Track a clip with a shadow; its points have the true displacement (frame, n, 2), px."""
    frames, inside = shadowed(clip.frames, centre_deg)
    path = tracked_path(TrackerInput(frames, *clip.tracker_arguments[1:]), BsplineDic())
    error, true_length, length = (
        np.hypot(*np.moveaxis(v, -1, 0)) for v in (path.displacement - true, true, path.displacement)
    )
    place = np.moveaxis(clip.points + true, -1, 0)[::-1]
    within = ndimage.map_coordinates(inside, place, order=1, mode="nearest") > 0.5
    beside, side = ~within.any(0), 1 / (quality.IMAGE_FRACTION * clip.size)
    model = quality.ERRORS["bspline_dic"]
    variance = model.variance(side, path.variance, side * path.disagreement, side * length)
    unseen = np.zeros(within.shape) if path.unseen is None else path.unseen
    nrmse = [
        100 * np.sqrt(np.mean(error[es][some] ** 2) / np.mean(true_length[es][some] ** 2))
        for some in (beside, within[es])
    ]
    chosen = within & (np.arange(len(within)) > 0)[:, None]
    return Sample(*nrmse, variance[chosen], (unseen * side * length)[chosen] ** 2, (side * error < 1)[chosen])


def samples(repository: Repository, cases: list[str]) -> Iterator[tuple[str, int, Sample]]:
    """View, size and sample of every clip of some hearts."""
    for case in cases:
        for view, section in repository.case(case).config.views.items():
            truth = read_truth(repository, case, view)
            for size, clip in read_clips(repository, case, view).items():
                true = truth.displacement / clip.spacing
                yield section.plane, size, sample(clip, true, truth.es, CENTRE_DEG[section.plane])


def stated(found: Sample, constant: float) -> np.ndarray:
    """Probability that the points in the shadow are near their true places."""
    return quality.within(1.0, found.variance + constant**2 * found.extrapolated)


def fitted(found: list[Sample]) -> float:
    """The constant `unseen` that makes what is observed most probable; every clip counts alike."""

    def surprise(constant: float) -> float:
        chances = [np.clip(stated(each, constant), 1e-6, 1 - 1e-6) for each in found]
        return -sum(np.mean(np.where(e.near, np.log(p), np.log(1 - p))) for e, p in zip(found, chances, strict=True))

    return float(minimize_scalar(surprise, bounds=(0, 1), method="bounded").x)


def main() -> None:
    """Print the table, or the constant."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository")
    parser.add_argument("case", nargs="+")
    parser.add_argument("--fit", action="store_true", help="print the constant `unseen` alone")
    parser.add_argument("--regardless", action="store_true", help="track as if all were seen")
    arguments = parser.parse_args()
    if arguments.regardless:
        visibility.NOISE_NCC = -np.inf
    found = list(samples(Repository(arguments.repository), arguments.case))
    if arguments.fit:
        print(f"unseen = {fitted([each for _, _, each in found]):.3g}")
        return
    constant = quality.ERRORS["bspline_dic"].unseen
    print("| view | px | beside, % | within, % | right, % | stated, % |\n|---|---|---|---|---|---|")
    for view, size in dict.fromkeys((view, size) for view, size, _ in found):
        some = [each for v, s, each in found if (v, s) == (view, size)]
        rows = [(e.beside, e.within, 100 * e.near.mean(), 100 * stated(e, constant).mean()) for e in some]
        print(f"| {view} | {size} | " + " | ".join(f"{value:.1f}" for value in np.mean(rows, 0)) + " |", flush=True)


if __name__ == "__main__":
    main()

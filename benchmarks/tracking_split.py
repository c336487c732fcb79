"""What of a tracker's error is the plane's, the beam's and the tracker's own: on a heart of a repository.

    python benchmarks/tracking_split.py out/demo

Trials at end-systole, for the views of the first heart, each as RMS error over RMS displacement:

plane    a perfect tracker of the plane (docs/difficulty.md), from end-diastole forwards, backwards through the end of
         the cycle, and both. What it misses is what leaves and enters the plane.
bound    the Cramer-Rao bound of the speckle of the repository's images, both ways.
blobs    images without a carrier and without decorrelation: random complex amplitudes in the wall, each a Gaussian of
         the beam's axial width that moves in the plane as its tissue does, log-compressed like the repository's. What a
         tracker misses there is its own.
images   the repository's images. The rest is the beam's: decorrelation, and the slip of speckle. Once more with every
         other frame alone, in the one nearest end-systole.

The correlation is that of consecutive frames in the wall along the path of the perfect tracker of the plane, the least
and the median of the cycle. The results are results/tracking_split.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import report

from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.difficulty.floors import difficulty
from echotruth.evaluation.scoring import Truth, metrics, read_truth, score
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints
from echotruth.heart import Heart
from echotruth.imaging.bmode import downsample
from echotruth.imaging.truth import displacement
from echotruth.imaging.view import Plane
from echotruth.repository.reader import Repository
from echotruth.tracking import track

RESULTS = Path(__file__).parent / "results"
WIDTH = 28e-6
"""Standard deviation of a blob, m: that of the axial width of the default pulse."""
SPACING = 25e-6
"""Mean distance of blobs, m; some five lie within the width of each."""
RANGE_DB = 55.0
TRACKER = BsplineDic()

Places = np.ndarray


def nrmse(found: np.ndarray, true: np.ndarray) -> float:
    """RMS error over RMS displacement (%) of displacements (point, 2) in one frame, m, where they are known."""
    error = found - true
    known = np.isfinite(error).all(-1)
    return float(100 * np.sqrt((error[known] ** 2).sum() / (true[known] ** 2).sum()))


def blobs(heart: Heart, plane: Plane, clip: Clip) -> np.ndarray:
    """Images, uint8, of the shape of the clip's, of blobs that move in the plane with their tissue."""
    side = clip.size * clip.spacing
    random = np.random.default_rng(1)
    low, high = (extreme(plane.to_image(heart.positions(0))[:, :2], axis=0) for extreme in (np.min, np.max))
    place = random.uniform(low, high, (int(np.prod((high - low) / SPACING)), 2))
    points = locate(heart.positions(0), heart.cells, plane.to_heart(np.column_stack([place, np.zeros(len(place))])))
    inside = points.cell >= 0
    tissue = MaterialPoints(points.cell[inside], points.xi[inside])
    weight = random.standard_normal((2, inside.sum()))
    envelopes = []
    for frame in range(len(clip.frames)):
        moved = place[inside] + (displacement(heart, frame, tissue) @ plane.axes.T)[:, :2]
        pixel = (moved + [side / 2, 0]) / clip.spacing - 0.5
        envelopes.append(np.hypot(*(_blurred(pixel, each, clip) for each in weight)))
    decibel = 20 * np.log10(np.array(envelopes) / np.max(envelopes) + 1e-9)
    return np.clip(255 * (1 + decibel / RANGE_DB), 0, 255).round().astype(np.uint8)


def _blurred(pixel: Places, weight: np.ndarray, clip: Clip) -> np.ndarray:
    """Sum of Gaussians at places (n, 2), px, by their values on the pixels around."""
    width = WIDTH / clip.spacing
    reach = int(np.ceil(4 * width))
    image, first = np.zeros((clip.size + 2 * reach + 2, clip.size + 2 * reach + 2)), np.floor(pixel).astype(int)
    steps = np.arange(-reach, reach + 2)
    across, down = (np.exp(-(((first + steps[:, None, None] - pixel)[..., k]) ** 2) / (2 * width**2)) for k in (0, 1))
    inside = ((first >= 0) & (first < clip.size)).all(1)
    for i, j in np.ndindex(len(steps), len(steps)):
        at = first[inside, 1] + steps[i] + reach, first[inside, 0] + steps[j] + reach
        np.add.at(image, at, (weight * down[i] * across[j])[inside])
    return image[reach : reach + clip.size, reach : reach + clip.size]


def halved(clip: Clip, truth: Truth) -> float:
    """RMS error over RMS displacement (%) of a track by every other frame, in the one at end-systole or before it."""
    frames, points, mask, spacing, time, seed = clip.tracker_arguments
    found = track(frames[::2], points, mask, spacing, time[::2], seed, TRACKER)[0][truth.es // 2] * spacing
    return nrmse(found, truth.displacement[2 * (truth.es // 2)])


def rows(repository: Repository, case: str, view: str) -> list[list[str]]:
    """Lines of the table for one view, one an image size."""
    truth, given, found = read_truth(repository, case, view), read_clips(repository, case, view), []
    free = blobs(repository.heart(case), repository.plane(case, view), next(iter(given.values())))
    for (size, clip), floor in zip(given.items(), difficulty(repository, case, view), strict=True):
        floors = "plane_forward", "plane_backward", "plane", "crb"
        cells = [view, str(size), *(f"{floor[f'floor_{name}_percent']:.1f}" for name in floors)]
        for frames in (downsample(free, free.shape[-1] // size), clip.frames):
            answer = clip.on_grid(*track(frames, *clip.tracker_arguments[1:], TRACKER))[0]
            figures = metrics(score(answer, truth), truth.wall.plane)
            tangential = "e_cc" if truth.wall.plane == "short_axis" else "e_ll"
            shown = "nrmse_percent", f"tracker_{tangential}_rms_pp", "tracker_e_rr_bias_pp"
            cells += [f"{figures[name]:.1f}" for name in shown]
        correlations = (f"{floor[f'correlation_{name}']:.2f}" for name in ("least", "median"))
        found.append([*cells, f"{halved(clip, truth):.1f}", *correlations])
        print(*found[-1], sep=" | ", flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository, as out/demo")
    folder = parser.parse_args().repository
    repository = Repository(folder)
    case = repository.present[0]
    strains = ("NRMSE", "E_CC or E_LL RMS", "E_RR bias")
    head = ["view", "px", "plane, forwards", "plane, backwards", "plane, both", "bound"]
    head += [f"{images}: {figure}" for images in ("blobs", "images") for figure in strains]
    head += ["images, every other frame: NRMSE", "correlation, least", "correlation, median"]
    table = report.table(head, [line for view in repository.views for line in rows(repository, case, view)])
    units = "`bspline_dic` at end-systole: % and percentage points of strain."
    text = ["# What of the error is whose", "", units, "", *table, ""]
    (RESULTS / "tracking_split.md").write_text("\n".join(text))


if __name__ == "__main__":
    main()

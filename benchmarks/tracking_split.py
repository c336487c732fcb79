"""What of a tracker's error is the plane's, the beam's and the tracker's own: on a heart of a repository.

    python benchmarks/tracking_split.py out/demo

Three trials at end-systole, for the views of the first heart, each as RMS error over RMS displacement:

plane    a perfect tracker of the plane: points go from frame to frame with the tissue that is in the plane where they
         are, by the motion of the finite elements; from end-diastole forwards, and backwards through the end of the
         cycle. What it misses is what leaves and enters the plane.
blobs    images without a carrier and without decorrelation: random complex amplitudes in the wall, each a Gaussian of
         the beam's axial width that moves in the plane as its tissue does, log-compressed like the repository's. What a
         tracker misses there is its own.
images   the repository's images. The rest is the beam's: decorrelation, and the slip of speckle. Once more with every
         other frame alone, in the one nearest end-systole.

The likeness is the correlation, over the wall, of a frame and the frame before when both are read where the tissue
truly is. The results are results/tracking_split.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import report
from scipy.interpolate import RBFInterpolator
from scipy.ndimage import map_coordinates

from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.clip import Clip, clips
from echotruth.evaluation.scoring import Truth, ground_truth, metrics, score
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, interpolate
from echotruth.imaging.bmode import downsample
from echotruth.imaging.truth import displacement
from echotruth.imaging.view import Plane
from echotruth.repository import ledger
from echotruth.tracking import bidirectional, track
from echotruth.workflow.job import Job

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


def in_plane(job: Job, plane: Plane, truth: Truth, order: Sequence[int]) -> np.ndarray:
    """Displacement (frame, point, 2), m, of points that go with whatever tissue is in the plane, frame by frame."""
    heart, here = job.heart, truth.wall.position
    found = np.zeros_like(truth.displacement)
    for before, now in pairwise(order):
        flat = np.column_stack([np.nan_to_num(here, nan=1.0), np.zeros(len(here))])  # 1 m away is no tissue
        points = locate(heart.positions(before), heart.cells, plane.to_heart(flat))
        inside = points.cell >= 0
        tissue = MaterialPoints(points.cell[inside], points.xi[inside])
        moved = plane.to_image(interpolate(heart.positions(now), heart.cells, tissue))
        here = np.full_like(here, np.nan)
        here[inside] = moved[:, :2]
        found[now] = here - truth.wall.position
    return found


def blobs(job: Job, plane: Plane, clip: Clip) -> np.ndarray:
    """Images, uint8, of the shape of the clip's, of blobs that move in the plane with their tissue."""
    heart, side = job.heart, clip.size * clip.spacing
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


def alike(clip: Clip, truth: Truth) -> list[float]:
    """Correlation of every frame but the first with the one before, along the true path of the tissue."""
    axial, lateral = np.nonzero(clip.mask)
    pixels, read = np.column_stack([lateral, axial]).astype(float), []
    for frame, moved in zip(clip.frames, truth.displacement / clip.spacing, strict=True):
        place = pixels + RBFInterpolator(clip.points, moved, neighbors=20)(pixels)
        read.append(map_coordinates(frame.astype(float), place.T[::-1], order=3))
    return [float(np.corrcoef(*pair)[0, 1]) for pair in pairwise(read)]


def halved(clip: Clip, truth: Truth) -> float:
    """RMS error over RMS displacement (%) of a track by every other frame, in the one at end-systole or before it."""
    frames, points, mask, spacing, time, seed = clip.tracker_arguments
    found = track(frames[::2], points, mask, spacing, time[::2], seed, TRACKER)[0][truth.es // 2] * spacing
    return nrmse(found, truth.displacement[2 * (truth.es // 2)])


def rows(job: Job, view: str) -> list[list[str]]:
    """Lines of the table for one view, one an image size."""
    truth, plane = ground_truth(job), Plane(**job.read("phantom", "origin", "axes"))
    true, found = truth.displacement[truth.es], []
    forward, backward = (
        nrmse(in_plane(job, plane, truth, order)[truth.es], true)
        for order in bidirectional.forward_backward(len(truth.displacement))
    )
    given = clips(job)
    free = blobs(job, plane, next(iter(given.values())))
    for size, clip in given.items():
        cells = [view, str(size), f"{forward:.1f}", f"{backward:.1f}"]
        for frames in (downsample(free, free.shape[-1] // size), clip.frames):
            answer = clip.on_grid(*track(frames, *clip.tracker_arguments[1:], TRACKER))[0]
            figures = metrics(score(answer, truth), truth.wall.plane)
            tangential = "e_cc" if truth.wall.plane == "short_axis" else "e_ll"
            shown = "nrmse_percent", f"tracker_{tangential}_rms_pp", "tracker_e_rr_bias_pp"
            cells += [f"{figures[name]:.1f}" for name in shown]
        cells.append(f"{halved(clip, truth):.1f}")
        likeness = alike(clip, truth)
        found.append([*cells, " ".join(f"{each:.2f}" for each in likeness[:4]), f"{np.median(likeness):.2f}"])
        print(*found[-1], sep=" | ", flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository, as out/demo")
    folder = parser.parse_args().repository
    case = next(iter(ledger.rows(folder / "registry.txt")))
    jobs = {view: Job(folder, "tracking", case, view) for view in Job(folder, "tracking", case).case.config.views}
    strains = ("NRMSE", "E_CC or E_LL RMS", "E_RR bias")
    head = ["view", "px", "plane, forwards", "plane, backwards"]
    head += [f"{images}: {figure}" for images in ("blobs", "images") for figure in strains]
    head += ["images, every other frame: NRMSE", "likeness of the first four steps", "of all, median"]
    table = report.table(head, [line for view, job in jobs.items() for line in rows(job, view)])
    units = "`bspline_dic` at end-systole: % and percentage points of strain."
    text = ["# What of the error is whose", "", units, "", *table, ""]
    (RESULTS / "tracking_split.md").write_text("\n".join(text))


if __name__ == "__main__":
    main()

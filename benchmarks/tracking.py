"""Trackers on rigid sub-pixel shifts of simulated speckle, and the time that a pair of images takes them.

    python benchmarks/tracking.py out/demo --external examples.openpiv_tracker:track

Shifts: scatterers in a block before the default array are moved by 0, 0.1, ... 1 px of the largest image, along both
axes at once, and imaged by the RF engine; a tracker sees the unmoved and the moved image. Bias is the mean error over
phantoms and points, noise the standard deviation about it; the largest over the shifts stands in the table. Time: that
of the clip of the view `mid` of a repository over its pairs, all trackers in turns, one process with as many threads as
cores, median of the turns. An external tracker is timed on the wall, and on a whole image full of texture. The example
of OpenPIV needs the extra `openpiv`. The results are results/tracking.md, tracking.json and tracking.png.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import report
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter

from echotruth.config import Config
from echotruth.config.tracking import External, default_trackers
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.bmode import bmode_clip
from echotruth.repository.reader import Repository
from echotruth.tracking import grid, track
from echotruth.units import mm, per_mm3

RESULTS = Path(__file__).parent / "results"
LOW, HIGH = np.array([-1.8e-3, 5.2e-3, -0.4e-3]), np.array([1.8e-3, 8.2e-3, 0.4e-3])
"""Corners of a block of scatterers (lateral, axial, elevation), m."""
WALL = (-1.2e-3, 1.2e-3, 5.8e-3, 7.6e-3)
"""What is tracked of it: lateral from and to, axial from and to, m; a window of the paper about each of its points
holds speckle alone."""
SHIFTS = np.arange(11) / 10
"""Of the pixels of the largest image."""
STEP = 10
"""Between points, px of the largest image."""
TURNS = 2
"""How often the time of a clip is taken."""
WHOLE = ", whole image"
"""Added to the name of an external tracker that is given an image full of texture, not only what is about the wall."""

Clips = dict[int, np.ndarray]


def blocks(config: Config, seed: int) -> Clips:
    """A block of speckle at every shift: image size to frames (shift, size, size), uint8."""
    random = np.random.default_rng(seed)
    number = int(config.phantom.density_per_mm3 * per_mm3 * np.prod(HIGH - LOW))
    position, amplitude = random.uniform(LOW, HIGH, (number, 3)), random.standard_normal(number)
    scanner = Scanner(config.probe, config.rf, 11e-3)
    pixel = config.bmode.field_of_view_mm * mm / config.bmode.sizes[0]
    moved = [position + shift * pixel * np.array([1.0, 1.0, 0.0]) for shift in SHIFTS]
    lines = np.stack([scanner.lines(each, amplitude) for each in moved])
    return bmode_clip(lines, scanner.scan, scanner.range, config.bmode)


def wall(config: Config, size: int) -> np.ndarray:
    """Pixels (size, size) that are tracked."""
    side = config.bmode.field_of_view_mm * mm
    lateral, axial = (np.arange(size) + 0.5) * side / size - side / 2, (np.arange(size)[:, None] + 0.5) * side / size
    left, right, near, far = WALL
    return (lateral > left) & (lateral < right) & (axial > near) & (axial < far)


def errors(config: Config, frames: np.ndarray, settings: Any) -> np.ndarray:
    """Tracked less true shift of the points, (shift, n, 2), px of the images."""
    size, largest = frames.shape[-1], config.bmode.sizes[0]
    places = grid((largest, largest), STEP).reshape(-1, 2)
    places = places[wall(config, largest)[tuple(places.astype(int).T[::-1])]]
    scale = size / largest
    points = (places + 0.5) * scale - 0.5
    given = points, wall(config, size), config.bmode.field_of_view_mm * mm / size, np.array([0.0, 1e-3]), 1
    found = [track(frames[[0, k]], *given, settings)[0][1] for k in range(len(frames))]
    return np.stack(found) - SHIFTS[:, None, None] * scale


def shifts(config: Config, trackers: dict[str, Any], phantoms: int) -> list[dict[str, Any]]:
    """Bias and noise by tracker and size: lists over the shifts, of the lateral and the axial component, px."""
    seen = [blocks(config, seed) for seed in range(phantoms)]
    rows = []
    for name, settings in trackers.items():
        for size in config.bmode.sizes:
            error = np.concatenate([errors(config, each[size], settings) for each in seen], axis=1)
            bias, noise = np.nanmean(error, axis=1), np.nanstd(error, axis=1)
            lost = float(np.isnan(error).any(-1).mean())
            rows.append({"tracker": name, "size": size, "bias": bias.tolist(), "noise": noise.tolist(), "lost": lost})
            print(name, size, np.abs(bias).max(), noise.max(), flush=True)
    return rows


def full(clip: Clip) -> Clip:
    """A clip that is wall everywhere: what surrounds a heart is black, and OpenPIV refuses that."""
    noise = gaussian_filter(np.random.default_rng(1).standard_normal(clip.mask.shape), 2.0, mode="wrap")
    grey = np.clip(128 + 40 * noise / noise.std(), 0, 255).astype(np.uint8)
    frames = np.stack([np.roll(grey, (t, -t), (0, 1)) for t in range(len(clip.frames))])
    return replace(clip, frames=frames, mask=np.ones_like(clip.mask))


def pace(folder: Path, trackers: dict[str, Any], external: str) -> dict[str, list[float]]:
    """Time of a pair of the largest images, s, of each tracker at every turn: that of the clip over its pairs."""
    repository = Repository(folder)
    clip = next(iter(read_clips(repository, repository.present[0], "mid").values()))
    entries = [(name, settings, clip) for name, settings in trackers.items()]
    if external:
        entries.append((external + WHOLE, trackers[external], full(clip)))
    taken: dict[str, list[float]] = {name: [] for name, *_ in entries}
    for turn in range(TURNS + 1):
        for name, settings, given in entries:
            frames, *rest = given.tracker_arguments
            count = len(frames) if turn else 3  # the first compiles
            start = time.perf_counter()
            track(frames[:count], *rest[:3], rest[3][:count], rest[4], settings)
            if turn:
                taken[name].append((time.perf_counter() - start) / (count - 1))
                print(name, taken[name][-1], flush=True)
    return taken


def page(found: dict[str, Any]) -> str:
    """The results as a table."""
    sizes = sorted({row["size"] for row in found["shifts"]}, reverse=True)
    rows = {(row["tracker"], row["size"]): row for row in found["shifts"]}
    paces = {name: 1e3 * median(taken) for name, taken in found["pace"].items()}
    external = paces.get(found["external"] + WHOLE, float("nan"))
    head = ["tracker", *(f"{size}: bias, noise (px)" for size in sizes), "ms a pair", "external, whole image / this"]
    body = [
        [name, *(_greatest(rows.get((name, size))) for size in sizes), f"{pace:.0f}", f"{external / pace:.2f}"]
        for name, pace in paces.items()
    ]
    lines = [
        "# Trackers on rigid shifts, and their pace",
        "",
        f"Shifts of 0 to 1 px of the largest image, {found['phantoms']} phantoms; the largest bias and noise over the",
        "shifts and both axes, in pixels of each size. Time of a pair of the largest images.",
        "",
        *report.table(head, body),
        "",
        "![Bias of every tracker over the shift](tracking.png)",
        "",
    ]
    return "\n".join(lines)


def _greatest(row: dict[str, Any] | None) -> str:
    return "" if row is None else f"{np.abs(row['bias']).max():.4f}, {np.max(row['noise']):.4f}"


def chart(found: dict[str, Any]) -> None:
    """Bias over the shift, a panel a size."""
    sizes = sorted({row["size"] for row in found["shifts"]}, reverse=True)
    sheet = Figure(figsize=(3.6 * len(sizes), 3.8), layout="constrained")
    panels = sheet.subplots(1, len(sizes), sharey=True, squeeze=False)[0]
    for panel, size in zip(panels, sizes, strict=True):
        for row in (each for each in found["shifts"] if each["size"] == size):
            panel.plot(SHIFTS * size / sizes[0], np.array(row["bias"])[:, 1], marker="o", ms=3, label=row["tracker"])
        panel.set(title=f"{size} px", xlabel="Axial shift (px)")
        panel.set_yscale("symlog", linthresh=0.01)
        panel.axhspan(-0.01, 0.01, color="0.9")
    panels[0].set_ylabel("Bias (px)")
    panels[-1].legend(fontsize=7)
    sheet.savefig(RESULTS / "tracking.png", dpi=150)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository with a view mid, as out/demo")
    parser.add_argument("--external", help="package.module:function of a tracker to measure against")
    parser.add_argument("--phantoms", type=int, default=4)
    arguments = parser.parse_args()
    trackers, external = default_trackers(), ""
    if arguments.external:
        external = arguments.external.partition(":")[0].rpartition(".")[2]
        trackers[external] = External(track=arguments.external)
    found = {
        "phantoms": arguments.phantoms,
        "external": external,
        "pace": pace(arguments.repository, trackers, external),
        "shifts": shifts(Config(), trackers, arguments.phantoms),
    }
    (RESULTS / "tracking.json").write_text(json.dumps(found, indent=1) + "\n")
    (RESULTS / "tracking.md").write_text(page(found))
    chart(found)


if __name__ == "__main__":
    main()

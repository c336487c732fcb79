"""How much of an uneven contraction a smooth tracker evens out, against its error on an even heart.

    python benchmarks/tracking_uneven.py out/demo

A ring of scatterers of the size of the default heart's mid slice moves inwards by 0.3 mm (1 + 0.4 cos(m angle)) at its
inside, and by less with 1/radius, and back again, in the plane; it is imaged by the RF engine. Beside the RMS error of
the radial displacement at the greatest contraction, over its RMS, stands the share of the m-th harmonic that a tracker
gives back, at the inside and the outside of the wall. The last columns are of the repository's heart, whose contraction
is the same all around and so tells nothing of what is evened out. The results are results/tracking_uneven.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import report

from echotruth.config import Config
from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.clip import read_clips
from echotruth.evaluation.scoring import metrics, read_truth, score
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.bmode import bmode_clip
from echotruth.repository.reader import Repository
from echotruth.tracking import track

RESULTS = Path(__file__).parent / "results"
INNER, OUTER, DEPTH = 1.4e-3, 2.3e-3, 6.5e-3
"""Radii of the ring and range of its centre, m."""
THICKNESS = 0.6e-3
"""Of the slab of scatterers, m."""
INWARDS, UNEVEN = 0.3e-3, 0.4
"""Displacement of the inside, m, and the harmonic's share of it."""
FRAMES, CYCLE = 20, 0.12
"""Of the cycle, and its duration, s."""
HARMONICS = (2, 3, 4)
SMOOTHNESS = (None, 375.0, 750.0, 1500.0, 3000.0, 6000.0)
"""None is the default: by the evidence of the images."""
RADII = np.array([1.5e-3, 2.2e-3])
"""Where the harmonics are told, m."""
ANGLES = np.linspace(0, 2 * np.pi, 144, endpoint=False)


def radial(radius: np.ndarray, angle: np.ndarray, harmonic: int) -> np.ndarray:
    """Radial displacement at the greatest contraction, m, outwards."""
    return -INWARDS * (1 + UNEVEN * np.cos(harmonic * angle)) * INNER / radius


def ring(config: Config, harmonic: int) -> dict[int, np.ndarray]:
    """Image size to the clip (frame, size, size), uint8."""
    random = np.random.default_rng(harmonic)
    number = int(config.phantom.si().density * np.pi * (OUTER**2 - INNER**2) * THICKNESS)
    radius = np.sqrt(random.uniform(INNER**2, OUTER**2, number))
    angle, height = random.uniform(0, 2 * np.pi, number), random.uniform(-THICKNESS / 2, THICKNESS / 2, number)
    amplitude, scanner = random.standard_normal(number), Scanner(config.probe, config.rf, 11e-3)
    inwards, lines = radial(radius, angle, harmonic), []
    for phase in np.pi * np.arange(FRAMES) / FRAMES:
        now = radius + np.sin(phase) ** 2 * inwards
        position = np.stack([now * np.cos(angle), DEPTH + now * np.sin(angle), height], axis=1)
        lines.append(scanner.lines(position, amplitude))
    return bmode_clip(np.stack(lines), scanner.scan, scanner.range, config.bmode)


def recovered(frames: np.ndarray, config: Config, harmonic: int, tracker: BsplineDic) -> tuple[float, np.ndarray]:
    """Radial error (%) at the greatest contraction, and shares of the harmonic at the radii."""
    size, side = frames.shape[-1], config.bmode.si().field_of_view
    spacing = side / size
    lateral, axial = (np.arange(size) + 0.5) * spacing - side / 2, (np.arange(size)[:, None] + 0.5) * spacing - DEPTH
    mask = (np.hypot(lateral, axial) > INNER) & (np.hypot(lateral, axial) < OUTER)
    radius, angle = (each.ravel() for each in np.meshgrid(np.linspace(*RADII, 5), ANGLES))
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = (radius[:, None] * normal + [side / 2, DEPTH]) / spacing - 0.5
    moved = track(frames, points, mask, spacing, np.arange(FRAMES) * CYCLE / FRAMES, 1, tracker)[0][FRAMES // 2]
    found, true = (moved * spacing * normal).sum(1), radial(radius, angle, harmonic)
    wave = np.cos(harmonic * angle)
    shares = (found * wave).reshape(len(ANGLES), -1).sum(0) / (true * wave).reshape(len(ANGLES), -1).sum(0)
    return 100 * float(np.sqrt(np.mean((found - true) ** 2) / np.mean(true**2))), shares[[0, -1]]


def heart(repository: Repository, tracker: BsplineDic) -> list[str]:
    """NRMSE (%) of a repository's view, one an image size."""
    place, cells = (repository.case().id, "mid"), []
    truth = read_truth(repository, *place)
    for one in read_clips(repository, *place).values():
        answer = one.on_grid(*track(*one.tracker_arguments, tracker))[0]
        cells.append(f"{metrics(score(answer, truth), truth.wall.plane)['nrmse_percent']:.1f}")
    return cells


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository with a view mid, as out/demo")
    folder, config = parser.parse_args().repository, Config()
    repository = Repository(folder)
    rings = {harmonic: ring(config, harmonic) for harmonic in HARMONICS}

    def cells(size: int, tracker: BsplineDic) -> list[str]:
        found = [recovered(frames[size], config, harmonic, tracker) for harmonic, frames in rings.items()]
        pairs = [(f"{error:.1f}", f"{inside:.2f}, {outside:.2f}") for error, (inside, outside) in found]
        return [cell for pair in pairs for cell in pair]

    largest, *coarser = config.bmode.sizes
    lines = []
    for smoothness in SMOOTHNESS:
        tracker, name = BsplineDic(smoothness=smoothness), f"{smoothness:g}" if smoothness else "by the images"
        lines.append([name, *cells(largest, tracker), *heart(repository, tracker)])
        print(*lines[-1], sep=" | ", flush=True)
    head = []
    for harmonic in HARMONICS:
        head += [f"m = {harmonic}: error, %", f"m = {harmonic}: shares inside, outside"]
    of_heart = [f"even heart, {size} px: NRMSE, %" for size in config.bmode.sizes]
    text = ["# What smoothness evens out", "", f"`bspline_dic` on rings of {largest} px that contract unevenly.", ""]
    text += [*report.table(["smoothness", *head, *of_heart], lines), "", "In smaller images, by the images:", ""]
    text += report.table(["image, px", *head], [[str(size), *cells(size, BsplineDic())] for size in coarser])
    (RESULTS / "tracking_uneven.md").write_text("\n".join([*text, ""]))


if __name__ == "__main__":
    main()

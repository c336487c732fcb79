"""How many scatterers the speckle needs: its statistics, the tracker's error and the likeness of frames by density.

    python benchmarks/density.py out/demo --densities 1000 2000 5000 10000

Envelopes are those of boxes about the focus with normally distributed amplitudes, compared with Rayleigh's
distribution; the clip is one view of a heart that is solved, imaged anew at each density. The results are
results/density.md.
"""

from __future__ import annotations

import argparse
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import speckle

from echotruth.config import Probe, Rf
from echotruth.evaluation.clip import Clip
from echotruth.evaluation.scoring import ground_truth, score
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.bmode import bmode_clip
from echotruth.imaging.labels import unpack
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import read_loop
from echotruth.seeds import generator
from echotruth.tracking.point_grid import grid_points
from echotruth.tracking.tracker import track
from echotruth.workflow.job import Job

HALF = np.array([2.2e-3, 1.1e-3, 1.2e-3])
"""Half the sides of the box (lateral, axial, elevation), m: beyond the beam to all sides."""


def statistics(density: float, boxes: int) -> float:
    """Mean over standard deviation of the envelope about the focus; 1.913 of fully developed speckle."""
    scanner = Scanner(Probe(), Rf(lines=31, sector_deg=24), 8e-3)
    samples = np.flatnonzero((scanner.range > speckle.REGION[0]) & (scanner.range < speckle.REGION[1]))
    found = []
    for box in range(boxes):
        random = np.random.default_rng(box)
        number = random.poisson(density * 1e9 * np.prod(2 * HALF))
        position = random.uniform(-HALF, HALF, (number, 3)) + [0, 6.5e-3, 0]
        found.append(np.abs(scanner.lines(position, random.standard_normal(number)))[:, samples])
    envelope = np.stack(found)
    power = (envelope**2).mean(axis=0)
    envelope /= np.sqrt(np.outer(power.mean(axis=1), power.mean(axis=0)) / power.mean())
    return float(envelope.mean() / envelope.std())


def clips(job: Job, density: float) -> dict[int, np.ndarray]:
    """B-mode of the view by size, and the scatterers that its beam meets."""
    heart, config = job.heart, job.case.config
    phantom = config.phantom.model_copy(update={"density_per_mm3": density})
    config = config.model_copy(update={"phantom": phantom})
    plane = Plane(**job.read("phantom", "origin", "axes"))
    random = partial(generator, job.case, job.view_name)
    sequence = Sequence(config, heart, plane, random)
    lines = sequence.lines(sequence.scatterers())
    return bmode_clip(lines, sequence.scanner.scan, sequence.scanner.range, config.bmode)


def errors(job: Job, images: dict[int, np.ndarray], tracker: str) -> list[float]:
    """NRMSE of a tracker at ES at every size, %."""
    plane, config, found = Plane(**job.read("phantom", "origin", "axes")), job.case.config, []
    truth = ground_truth(job.heart, plane, job.view.plane, config)
    for size, frames in images.items():
        mask = unpack(job.read(f"truth/{size}", "labels")["labels"][0])["mask"]
        given = Clip(
            frames=frames,
            mask=mask,
            inside=truth.inside,
            points=grid_points(config, size)[truth.inside],
            spacing=config.bmode.si().field_of_view / size,
            frame_time=read_loop(config.loop).time,
            seed=1,
        )
        displacement, _ = given.on_grid(*track(*given.tracker_arguments, config.tracking.trackers[tracker]))
        found.append(100 * float(score(displacement, truth)["nrmse"][0, -1]))
    return found


def likeness(frames: np.ndarray, mask: np.ndarray) -> float:
    """Mean correlation of the wall's grey values from frame to frame, nothing followed."""
    wall = frames[:, mask].astype(float)
    return float(np.mean([np.corrcoef(one, other)[0, 1] for one, other in pairwise(wall)]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, help="folder of a repository that is made, as out/demo")
    parser.add_argument("--densities", type=float, nargs="+", default=[1000, 2000, 5000, 10000])
    parser.add_argument("--view", default="mid")
    parser.add_argument("--tracker", default="bspline_dic")
    parser.add_argument("--boxes", type=int, default=24)
    arguments = parser.parse_args()
    job = Job(arguments.repository, "rf", "heart", arguments.view)
    sizes = job.case.config.bmode.sizes
    mask = unpack(job.read(f"truth/{sizes[0]}", "labels")["labels"][0])["mask"]
    rows = []
    for density in arguments.densities:
        images = clips(job, density)
        nrmse = " / ".join(f"{each:.2f}" for each in errors(job, images, arguments.tracker))
        snr, alike = statistics(density, arguments.boxes), likeness(images[sizes[0]], mask)
        rows.append(f"| {density:g} | {snr:.3f} | {nrmse} | {alike:.3f} |")
        print(rows[-1], flush=True)
    heads = " / ".join(map(str, sizes))
    lines = [
        "# Scatterers per cubic millimetre",
        "",
        f"Array of 25 MHz. Speckle of {arguments.boxes} boxes about the focus, 1.913 where fully developed; view",
        f"`{arguments.view}` of the repository `{job.case.config.name}`: {arguments.tracker} at end-systole, and the",
        "mean correlation of the wall's grey values from frame to frame where nothing is followed.",
        "",
        f"| density | mean / deviation | NRMSE at {heads} px (%) | frame to frame |",
        "|---|---|---|---|",
        *rows,
        "",
    ]
    (Path(__file__).parent / "results/density.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()

"""How much of the echoes of a heart is lost where scatterers beside the beam are left out.

    python benchmarks/left_out.py out/demo out/rat out/human

The full matrix of every view at end-diastole and end-systole, of the scatterers in the beam and of all: the norm of the
difference over that of all. The results are results/left_out.md.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

import numpy as np

from echotruth.fem.tetrahedra import MaterialPoints
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.imaging.medium.medium import seed_medium
from echotruth.imaging.medium.wall import Scatterers
from echotruth.imaging.rf import elevation
from echotruth.imaging.view import Plane
from echotruth.repository.ledger import record_path
from echotruth.seeds import generator
from echotruth.workflow.job import Job


def scanners(job: Job) -> tuple[Scanner, Scanner]:
    """The scanner of a view, and one whose beam has no end in elevation."""
    config, energy = job.case.config, elevation.BEAM_TAIL_ENERGY
    settings = config.probe, config.rf, imaging_depth(config.rf, config.bmode)
    limited = Scanner(*settings)
    elevation.BEAM_TAIL_ENERGY = 0.0
    endless = Scanner(*settings)
    elevation.BEAM_TAIL_ENERGY = energy
    return limited, endless


def losses(job: Job) -> list[str]:
    """Rows of the table: all scatterers, those in the beam, and the loss, at ED and at ES."""
    heart, config, rows = job.heart, job.case.config, []
    limited, endless = scanners(job)
    plane = Plane(**job.read("phantom", "origin", "axes"))
    seeded = seed_medium(config, heart, plane, partial(generator, job.case, job.view_name), endless.matrix.in_beam)
    scatterers = Scatterers(MaterialPoints(seeded["cell"], seeded["xi"]), seeded["amplitude"], False)
    for name, frame in (("ED", 0), ("ES", heart.es)):
        position = scatterers.image_positions(heart.positions(frame), heart.cells, plane)
        inside = limited.matrix.in_beam(position)
        echoes = endless.matrix(position, seeded["amplitude"])
        lost = np.linalg.norm(limited.matrix(position, seeded["amplitude"]) - echoes) / np.linalg.norm(echoes)
        case = f"| {config.probe.preset} | {job.view_name} | {name} |"
        rows.append(f"{case} {len(position)} | {inside.sum()} | {100 * lost:.2f} |")
        print(rows[-1], flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repositories", type=Path, nargs="+", help="folders of repositories of one heart, as out/demo")
    rows = []
    for folder in parser.parse_args().repositories:
        records = record_path(folder, "rf", "*", "*")
        for path in sorted(folder.glob(str(records.relative_to(folder)))):
            rows += losses(Job(folder, "rf", path.parent.name, path.stem))
    lines = [
        "# Echoes that are left out beside the beam",
        "",
        "Scatterers of the wall, those in the beam of the frame, and the echoes of the others over all (L2).",
        "",
        "| array | view | frame | scatterers | in the beam | left out (%) |",
        "|---|---|---|---|---|---|",
        *rows,
        "",
    ]
    (Path(__file__).parent / "results/left_out.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()

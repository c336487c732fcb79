"""Hearts in a circulation: what drugs and diseases do to pressure, volume and strain, and how the wall moves.

    python benchmarks/circulation.py                       # a quarter of an hour on two cores
    python benchmarks/circulation.py --elements 12 8 2     # three minutes

Writes results/circulation.json and the picture of docs/physiology.md, docs/gallery/circulation.png: the wall of the
healthy heart, of an infarct and of a left bundle branch block, coloured by the strain along the fibres.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

HEARTS: dict[str, dict[str, Any]] = {
    "healthy": {},
    "infarct": {"pathology.infarct.segments": [7, 8, 12, 13, 14]},
    "left bundle branch block": {"pathology.late_activation.preset": "lbbb"},
    "contractility 0.6": {"loop.circulation.contractility": 0.6},
    "contractility 1.3": {"loop.circulation.contractility": 1.3},
    "resistance 1.5": {"loop.circulation.resistance": 1.5},
    "preload 0.5": {"loop.circulation.preload": 0.5},
    "preload 2": {"loop.circulation.preload": 2.0},
    "dilation 1.2, contractility 0.5": {"geometry.dilation": 1.2, "loop.circulation.contractility": 0.5},
    "hypertrophy 1.2, resistance 1.3": {"geometry.hypertrophy": 1.2, "loop.circulation.resistance": 1.3},
}
"""Name -> keys that differ from the default mouse in a circulation."""
DRAWN = tuple(HEARTS)[:3]
SHOWN_MS = (0, 6, 9, 15, 24, 36, 48, 60, 69, 81, 93, 108)
"""Times of the picture's columns, whole frames of 3 ms."""
SLAB_MM, LIMIT = 0.5, 0.25
"""Half the thickness of the slabs that are drawn, and the strain at the ends of the colours."""
MMHG = 133.322387415
HERE = Path(__file__).parent


def solved(name: str, elements: tuple[int, int, int]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Measures of a heart, and what is drawn of it: centroids (frame, cell, 3), m, and fibre strain (frame, cell)."""
    import numba
    from threadpoolctl import threadpool_limits

    from echotruth.config import Config
    from echotruth.config.loading import override
    from echotruth.heart import Heart
    from echotruth.mechanics.beat import beat
    from echotruth.mechanics.derived import centroid_kinematics
    from echotruth.mechanics.physiology import measured_heart

    numba.set_num_threads(1)
    names = ("circumferential_elements", "longitudinal_elements", "transmural_elements")
    mesh = {f"geometry.{key}": count for key, count in zip(names, elements, strict=True)}
    config = override(Config(), {"loop.kind": "circulation", **mesh, **HEARTS[name]})
    start = time.process_time()
    with threadpool_limits(1):
        arrays = beat(config)
    seconds = time.process_time() - start
    found, _ = measured_heart(arrays, config)
    mechanics, geometry = arrays["mechanics"], arrays["geometry"]
    strain = centroid_kinematics(Heart.of(arrays, config))["fibre_strain"][..., 0]
    corners = (geometry["node_position"] + mechanics["displacement"])[:, geometry["cell_node"][:, :4]]
    row = {
        "heart": name,
        "edv_uL": float(mechanics["volume"][0]) * 1e9,
        "esv_uL": float(mechanics["volume"].min()) * 1e9,
        "ejection_fraction": float(found["ejection_fraction"]),
        "pressure_max_mmHg": float(mechanics["pressure"].max()) / MMHG,
        "circumferential_strain": float(found["circumferential_strain"]),
        "longitudinal_strain": float(found["longitudinal_strain"]),
        "gls": float(found["gls"]),
        "twist_es_deg": float(np.degrees(found["twist_es"])),
        "seconds": seconds,
        **_regions(arrays),
    }
    return row, {"centroid": corners.mean(axis=2), "strain": strain}


def _regions(arrays: dict[str, Any]) -> dict[str, float]:
    """E_CC at end-systole of the scar, the septum and the lateral wall, and the largest step of the two from frame to
    frame."""
    strain, segment = arrays["kinematics"]["strain"][..., 1], arrays["fibres"]["segment"]
    es, scar = int(arrays["mechanics"]["es_frame"]), arrays["pathology"]["region"] == 1
    walls = {"septal": np.isin(segment, (2, 3, 8, 9, 14)), "lateral": np.isin(segment, (5, 6, 11, 12, 16))}
    found = {name: strain[:, cells].mean(axis=1) for name, cells in walls.items()}
    rows = {f"{name}_es": float(values[es]) for name, values in found.items()}
    rows["largest_step"] = max(float(np.abs(np.diff(values)).max()) for values in found.values())
    return rows | ({"scar_es": float(strain[es, scar].mean())} if scar.any() else {})


def draw(hearts: dict[str, dict[str, np.ndarray]], period: float, path: Path) -> None:
    """Picture of the hearts: short axis at mid level over long axis, in columns of time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 2.6 * len(hearts)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2 * len(hearts), len(SHOWN_MS), height_ratios=[1, 1.33] * len(hearts))
    colours = Normalize(-LIMIT, LIMIT)
    for row, (name, heart) in enumerate(hearts.items()):
        ed = heart["centroid"][0] * 1e3
        slabs = (np.abs(ed[:, 2] - ed[:, 2].min() / 2) < SLAB_MM, (0, 1)), (np.abs(ed[:, 1]) < SLAB_MM, (0, 2))
        for column, time_ms in enumerate(SHOWN_MS):
            frame = round(time_ms * 1e-3 / period * len(heart["strain"]))
            at, strain = heart["centroid"][frame] * 1e3, heart["strain"][frame]
            for part, (cells, (across, up)) in enumerate(slabs):
                axis = axes[2 * row + part, column]
                axis.scatter(-at[cells, across], at[cells, up], c=strain[cells], cmap="RdBu", norm=colours, s=5)
                axis.set(xlim=(-2.9, 2.9), ylim=(-2.9, 2.9) if part == 0 else (-7.8, 0.3), aspect="equal")
                axis.set_axis_off()
            if row == 0:
                axes[0, column].set_title(f"{time_ms} ms", fontsize=8)
        axes[2 * row, 0].text(-3.4, -2.9, name, fontsize=9, rotation="vertical", va="center", ha="right")
    bar = figure.colorbar(ScalarMappable(colours, "RdBu"), ax=axes, shrink=0.3, aspect=30)
    bar.set_label("strain along the fibres since end-diastole", fontsize=8)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Solve, write, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--elements", type=int, nargs=3, default=(24, 12, 3), help="around, along and through")
    parser.add_argument("--out", type=Path, default=HERE / "results/circulation.json")
    parser.add_argument("--picture", type=Path, default=HERE.parent / "docs/gallery/circulation.png")
    arguments = parser.parse_args()
    rows, drawn = [], {}
    with ProcessPoolExecutor(arguments.processes) as pool:
        tasks = {name: pool.submit(solved, name, tuple(arguments.elements)) for name in HEARTS}
        for name, task in tasks.items():
            row, moving = task.result()
            rows.append(row)
            if name in DRAWN:
                drawn[name] = moving
            print(json.dumps(row), flush=True)
    arguments.out.write_text(json.dumps(rows, indent=1) + "\n")
    draw(drawn, 0.12, arguments.picture)


if __name__ == "__main__":
    main()

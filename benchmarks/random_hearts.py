"""Hearts drawn at random over the ranges of a sweep: how many beat, and whether any is wrong in silence.

    python benchmarks/random_hearts.py --hearts 50 --processes 2

Every heart is drawn from its number alone: fibres within 6 deg of the default, material, loop and geometry over all of
their range. One that ends is wrong in silence if it misses its loop by more than 0.5 %, has det F below 0.2 somewhere,
leaves forces out of balance, twists the wrong way at end-systole, or thickens by more than a mouse does before it
ejects, and is not marked.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

RANGES = {
    "geometry.scale": (0.88, 1.12),
    "geometry.wall_mm": (0.7, 1.3),
    "fibres.endo_deg": (74.0, 86.0),
    "fibres.epi_deg": (-48.0, -36.0),
    "mechanics.material.stiffness_kPa": (0.5, 4.0),
    "mechanics.material.fibre": (6.0, 20.0),
    "mechanics.active.length_dependence": (0.0, 2.0),
    "loop.heart_rate_per_min": (400.0, 620.0),
    "loop.edp_mmHg": (1.0, 8.0),
    "loop.esp_mmHg": (80.0, 120.0),
    "loop.edv_uL": (25.0, 65.0),
    "loop.esv_uL": (7.0, 29.0),
}
"""Mice: Pacher et al., Nat Protoc 3 (2008) 1422; Vinhas et al. 2013; fibres and wall as in docs/conventions.md."""

EJECTION = (0.3, 0.8)
"""Ejection fractions kept of what volumes drawn apart would give; the loop is scaled to what the heart holds."""

LOOP_ERROR, DET_F, RESIDUAL = 5e-3, 0.2, 1e-7
TWIST_ES, RADIAL_IVC = 0.0, 0.12


def drawn(number: int) -> dict[str, float]:
    """Parameters of a heart."""
    random = np.random.default_rng([2026, number])
    while True:
        values = {key: float(random.uniform(*limits)) for key, limits in RANGES.items()}
        if EJECTION[0] < 1 - values["loop.esv_uL"] / values["loop.edv_uL"] < EJECTION[1]:
            return values


def solved(number: int, elements: tuple[int, int, int]) -> dict[str, Any]:
    """Beat one heart and judge it."""
    import numba
    from threadpoolctl import threadpool_limits

    from echotruth.config import Config
    from echotruth.config.loading import override
    from echotruth.mechanics.beat import beat
    from echotruth.mechanics.bounds import violated_bound
    from echotruth.mechanics.physiology import measures
    from echotruth.mechanics.solver.newton import Diverged

    numba.set_num_threads(1)
    names = ("circumferential_elements", "longitudinal_elements", "transmural_elements")
    mesh = {f"geometry.{name}": count for name, count in zip(names, elements, strict=True)}
    values = drawn(number)
    config = override(Config(), values | mesh)
    start = time.process_time()
    row: dict[str, Any] = {"heart": number, **values}
    try:
        with threadpool_limits(1):
            arrays = beat(config)
    except Diverged as error:
        return row | {"seconds": time.process_time() - start, "reason": str(error)}
    mechanics, kinematics = arrays["mechanics"], arrays["kinematics"]
    found = measures(arrays["geometry"], mechanics, kinematics)
    return row | {
        "seconds": time.process_time() - start,
        "loop_error": float(np.abs(mechanics["volume"] / mechanics["volume_target"] - 1).max()),
        "pressure_error": float(np.abs(mechanics["pressure"] / mechanics["pressure_target"] - 1).max()),
        "det_f": float(kinematics["volume_ratio_min"].min()),
        "residual": float(mechanics["residual"].max()),
        "factorizations": int(mechanics["newton_steps"].sum()),
        "twist_es_deg": float(np.degrees(found["twist_es"])),
        "twist_ivc_deg": float(np.degrees(found["twist_ivc"])),
        "radial_strain_ivc": float(found["strain_ivc"][0]),
        "tension_es_kPa": float(found["tension_es"]) / 1e3,
        "implausible": violated_bound({**found, "active_tension": mechanics["active_tension"]}, config.physiology),
    }


def wrong(row: dict[str, Any]) -> bool:
    """Whether a heart ended and is wrong."""
    loop = max(row["loop_error"], row["pressure_error"])
    solved = loop <= LOOP_ERROR and row["det_f"] >= DET_F and row["residual"] <= RESIDUAL
    return not (solved and row["twist_es_deg"] >= TWIST_ES and row["radial_strain_ivc"] <= RADIAL_IVC)


def main() -> None:
    """Draw, solve, report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hearts", type=int, default=50)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--elements", type=int, nargs=3, default=(24, 12, 3), help="around, along and through")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/random_hearts.json"))
    arguments = parser.parse_args()
    rows = []
    with ProcessPoolExecutor(arguments.processes) as pool:
        tasks = [pool.submit(solved, number, tuple(arguments.elements)) for number in range(arguments.hearts)]
        for task in tasks:
            rows.append(task.result())
            row = rows[-1]
            print(row["heart"], row.get("reason") or f"det F {row['det_f']:.2f}", f"{row['seconds']:.0f} s", flush=True)
            arguments.out.parent.mkdir(parents=True, exist_ok=True)
            arguments.out.write_text(json.dumps(rows, indent=1) + "\n")
    ended = [row for row in rows if "reason" not in row]
    silent = [row["heart"] for row in ended if wrong(row) and not row["implausible"]]
    print(f"{len(ended)} of {len(rows)} beat; {len(silent)} wrong in silence {silent or ''}")
    print(f"{sum(bool(row['implausible']) for row in ended)} marked implausible")


if __name__ == "__main__":
    main()

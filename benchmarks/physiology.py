"""Search for the heart that moves as an animal's: what each means does, and which targets oppose each other.

    python benchmarks/physiology.py search --hearts 256 --processes 2
    python benchmarks/physiology.py levers
    python benchmarks/physiology.py confirm
    python benchmarks/physiology.py refine

Hearts are drawn by a scrambled Sobol sequence over the levers (`search`), varied one lever at a time around the chosen
one (`levers`), and solved on the mesh that ships (`confirm`, the paper's heart `paper`) and a finer one (`refine`). The
search mesh has six elements around: shape, fibres and supports are the same all around, and its wall means are those of
the full mesh to the second digit. Each writes its rows as JSON.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

SEARCH_MESH, SHIPPED_MESH, FINE_MESH = (6, 8, 2), (24, 12, 3), (30, 16, 4)
SEED = 2026


class Lever(NamedTuple):
    """A means, with the range in which it is drawn.

    Attributes
    ----------
    keys : tuple of str
        Keys of the configuration that it sets.
    low, high : float
    name : str
    """

    keys: tuple[str, ...]
    low: float
    high: float
    name: str


SPRING = ("mechanics.pericardium.spring_kPa_per_mm",)
LEVERS = (
    Lever(("fibres.endo_deg",), 50.0, 84.0, "endocardial angle (deg)"),
    Lever(("fibres.epi_deg",), -60.0, -36.0, "epicardial angle (deg)"),
    Lever(("fibres.transverse_endo_deg", "fibres.transverse_epi_deg"), -8.0, 8.0, "transverse angle (deg)"),
    Lever(("mechanics.active.sheet_share",), 0.0, 0.5, "share of tension, sheet"),
    Lever(("mechanics.active.normal_share",), 0.0, 0.4, "share of tension, normal"),
    Lever(SPRING, 0.0, 4.0, "pericardium (kPa/mm)"),
    Lever(("mechanics.pericardium.dashpot_kPa_s_per_mm",), 0.0, 0.02, "pericardium (kPa s/mm)"),
    Lever(("mechanics.material.shear",), 2.0, 12.0, "passive shear b_fs"),
    Lever(("mechanics.elastic_base.circumferential_spring_kPa_per_mm",), 0.1, 10.0, "elastic base (kPa/mm)"),
)
"""Helix angles: from the mid-ventricle of five mice, +52 +- 5 and -41 +- 3 deg (Angeli et al., J Cardiovasc Magn Reson
16 (2014) 77, doi 10.1186/s12968-014-0077-x), to the paper's 84 and beyond 42, since voxels at the wall's edges average
over depth. Shares: 0.4 across the fibre in Walker et al., Am J Physiol 289 (2005) H692; pericardium: Strocchi et al.
2020, doi 10.1016/j.jbiomech.2020.109645, scaled to the mouse.
Half of the hearts have a base that keeps its plane (`radial_free`), for which the last lever means nothing."""


class Target(NamedTuple):
    """A measured quantity that a heart should have.

    Attributes
    ----------
    centre, spread : float
        Published mean and standard deviation, in the unit of the name.
    low, high : float
        What is asked of the shipped heart.
    """

    name: str
    centre: float
    spread: float
    low: float
    high: float


INFINITY = float("inf")
BEFORE_EJECTION = {
    "rr_ivc": Target("E_RR at the end of IVC", 0, 0.05, -INFINITY, 0.08),
    "rc_ivc": Target("largest layer mean of E_RC, end of IVC", 0, 0.04, 0, 0.08),
    "rl_ivc": Target("largest layer mean of E_RL, end of IVC", 0, 0.04, 0, 0.08),
}
"""Of any species: next to no thickening or shear through the wall."""

TARGETS = {
    "mouse": {
        "twist_es": Target("twist at ES (deg)", 5.6, 0.9, 3, 9),
        "twist_ivc": Target("twist at the end of IVC (deg)", 0, 1.5, -3, 3),
        **BEFORE_EJECTION,
        "rc_es": Target("E_RC at ES", 0, 0.08, -0.05, 0.05),
        "rl_es": Target("E_RL at ES", 0.04, 0.12, -0.05, 0.05),
        "cl_es": Target("E_CL at ES", 0.03, 0.07, 0.01, 0.08),
        "cc_es": Target("E_CC at ES", -0.13, 0.03, -0.19, -0.14),
        "ll_es": Target("E_LL at ES", -0.18, 0.14, -INFINITY, -0.10),
        "rr_es": Target("E_RR at ES", 0.29, 0.17, -INFINITY, INFINITY),
    },
    "human": {
        "twist_es": Target("twist at ES (deg)", 13, 4, 6, 16),
        "twist_ivc": Target("twist at the end of IVC (deg)", 0, 2, -3, 3),
        **BEFORE_EJECTION,
        "cc_es": Target("E_CC at ES", -0.19, 0.03, -0.24, -0.15),
        "gls": Target("GLS", -0.19, 0.02, -0.22, -0.16),
    },
}
"""Mouse: 3-D DENSE of seven mice (Zhong et al. 2011, doi 10.1186/1532-429X-13-83); isovolumic shear and thickening are
near none in life (doi 10.1186/1532-429X-12-48). Human: twist and its course doi 10.1186/1532-429X-14-49."""
TARGETS["rat"] = TARGETS["mouse"]


SPRING_SCALE = {"mouse": 1.0, "rat": 0.5, "human": 0.1}
"""Factor of the pericardial spring: at equal strains it is as stiff in any heart."""


def levers_of(species: str) -> tuple[Lever, ...]:
    """The levers, with ranges for a species."""
    factor = SPRING_SCALE[species]
    return tuple(
        lever._replace(low=factor * lever.low, high=factor * lever.high) if lever.keys == SPRING else lever
        for lever in LEVERS
    )


def drawn(species: str, hearts: int) -> list[dict[str, Any]]:
    """Settings of hearts drawn over the levers."""
    from scipy.stats.qmc import Sobol

    unit = Sobol(len(LEVERS) + 1, seed=SEED).random(hearts)
    rows = []
    for point in unit:
        values: dict[str, Any] = {"mechanics.base": "elastic" if point[-1] < 0.5 else "radial_free"}
        for lever, at in zip(levers_of(species), point, strict=False):
            values |= dict.fromkeys(lever.keys, round(lever.low + float(at) * (lever.high - lever.low), 4))
        rows.append(values)
    return rows


def varied(species: str, steps: int) -> list[dict[str, Any]]:
    """Settings that differ from the chosen ones in one lever, and the chosen ones first."""
    chosen = shipped({"geometry": {"preset": species}})
    rows = [dict(chosen)]
    for lever in levers_of(species):
        base = {"mechanics.base": "elastic"} if lever.keys[0].startswith("mechanics.elastic_base") else {}
        for value in np.linspace(lever.low, lever.high, steps):
            rows.append(chosen | base | dict.fromkeys(lever.keys, round(float(value), 4)))
    return rows


def solved(species: str, values: dict[str, Any], mesh: tuple[int, int, int]) -> dict[str, Any]:
    """Beat one heart and measure it."""
    import time

    import numba
    from threadpoolctl import threadpool_limits

    from echotruth.config.building import configure
    from echotruth.config.loading import override
    from echotruth.mechanics.beat import beat
    from echotruth.mechanics.physiology import measures
    from echotruth.mechanics.solver.newton import Diverged

    numba.set_num_threads(1)
    names = ("circumferential_elements", "longitudinal_elements", "transmural_elements")
    elements = {f"geometry.{name}": count for name, count in zip(names, mesh, strict=True)}
    config = override(configure(geometry={"preset": species}), values | elements)
    start = time.process_time()
    try:
        with threadpool_limits(1):
            arrays = beat(config)
    except Diverged as error:
        return {"species": species, "mesh": mesh, "values": values, "failed": str(error)}
    found = measures(arrays["geometry"], arrays["mechanics"], arrays["kinematics"], arrays["fibres"]["wall_depth"])
    return {
        "species": species,
        "mesh": mesh,
        "values": values,
        "seconds": round(time.process_time() - start, 1),
        **quantities(found, arrays),
    }


def quantities(found: dict[str, Any], arrays: dict[str, Any]) -> dict[str, Any]:
    """What is compared with the targets, and what else is worth a column."""
    layers, mean, end = np.abs(found["layer_strain_ivc"]), found["strain_ivc"], found["strain_es"]
    es = int(arrays["mechanics"]["es_frame"])
    approach = found["base_motion"] - found["apex_motion"]
    row = {
        "twist_es": np.degrees(found["twist_es"]),
        "twist_ivc": np.degrees(found["twist_ivc"]),
        "peak_delay_ms": 1e3 * found["twist_peak_delay"],
        "rr_ivc": mean[0],
        "rc_ivc": np.nanmax(layers[:, 3]),
        "rl_ivc": np.nanmax(layers[:, 4]),
        **{f"{name}_es": end[k] for k, name in enumerate(("rr", "cc", "ll", "rc", "rl", "cl"))},
        "base_mm": -1e3 * approach[es],
        "gls": found["gls"],
        "thickening": found["wall_thickening"],
        "tei": found["tei_index"],
        "det_f": found["volume_ratio_min"],
        "loop_error": found["loop_error"],
        "stiffness_kPa": arrays["mechanics"]["stiffness"] / 1e3,
        "tension_es_kPa": found["tension_es"] / 1e3,
        "tension_min_kPa": found["tension_min"] / 1e3,
    }
    return {name: float(np.round(value, 5)) for name, value in row.items()}


def misfit(row: dict[str, Any]) -> float:
    """Root mean square distance from the targets of the species, in published standard deviations."""
    if "failed" in row:
        return INFINITY
    targets = TARGETS[row["species"]]
    away = [(row[name] - target.centre) / target.spread for name, target in targets.items()]
    return float(np.sqrt(np.mean(np.square(away))))


def missed(row: dict[str, Any]) -> list[str]:
    """Names of the targets whose asked range a heart misses."""
    if "failed" in row:
        return ["solution"]
    targets = TARGETS[row["species"]]
    return [name for name, target in targets.items() if not target.low <= row[name] <= target.high]


def run(species: str, settings: list[dict[str, Any]], mesh: tuple[int, int, int], processes: int, out: Path) -> None:
    """Solve all, and write the rows in their order as they come."""
    rows: dict[int, dict[str, Any]] = {}
    with ProcessPoolExecutor(processes) as pool:
        tasks = {pool.submit(solved, species, values, mesh): number for number, values in enumerate(settings)}
        for task in as_completed(tasks):
            rows[tasks[task]] = row = task.result()
            print(len(rows), "of", len(tasks), f"misfit {misfit(row):.2f}", *missed(row), flush=True)
            lines = (json.dumps(rows[number]) for number in sorted(rows))
            out.write_text("[\n" + ",\n".join(lines) + "\n]\n")


def shipped(source: Any) -> dict[str, Any]:
    """The levers of a configuration that ships, by anything that `configure` accepts."""
    from echotruth.config.building import configure

    config = configure(source)
    values: dict[str, Any] = {"mechanics.base": config.mechanics.base}
    for lever in LEVERS:
        for key in lever.keys:
            value: Any = config
            for name in key.split("."):
                value = getattr(value, name)
            values[key] = value
    return values


def main() -> None:
    """Search, vary or confirm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("search", "levers", "confirm", "refine", "paper"))
    parser.add_argument("--species", default="mouse", choices=tuple(TARGETS))
    parser.add_argument("--hearts", type=int, default=320)
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--rows", type=Path, default=Path("out/physiology"), help="folder of the rows")
    arguments = parser.parse_args()
    arguments.rows.mkdir(parents=True, exist_ok=True)
    species, out = arguments.species, arguments.rows / f"{arguments.species}_{arguments.what}.json"
    settings = {
        "search": lambda: drawn(species, arguments.hearts),
        "levers": lambda: varied(species, arguments.steps),
        "confirm": lambda: [{}],
        "refine": lambda: [{}],
        "paper": lambda: [shipped("config/paper.yaml")],
    }[arguments.what]()
    mesh = {"search": SEARCH_MESH, "levers": SEARCH_MESH, "refine": FINE_MESH}.get(arguments.what, SHIPPED_MESH)
    run(species, settings, mesh, arguments.processes, out)


if __name__ == "__main__":
    main()

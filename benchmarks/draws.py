"""Hearts that come with the package: which are solved and within their bounds, and why not.

    python benchmarks/draws.py mouse rat human --hearts 50
    python benchmarks/draws.py mouse rat human --presets

The first solves those of `cases.draw.preset: hearts`, and those without disease. It prints a line a heart, of ten and
three seconds of CPU time, and the sum of each species. The second solves healthy hearts and every preset of disease, in
ten seconds, and on a finer mesh, in forty. It adds them to results/presets.csv, of which it leaves out
what is there: the values that have bounds, in the units of their keys, and the extremes over segments and levels of the
strain at end-systole. `tests/benchmark/test_presets.py` holds them to the bounds.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

import echotruth as et
from echotruth.config.cases import HEARTS
from echotruth.config.diagnosis import bounds_of
from echotruth.mechanics.beat import beat
from echotruth.mechanics.bounds import BOUNDS, CC, LL, RR, violation
from echotruth.mechanics.physiology import measured_heart

TABLE = Path(__file__).parent / "results/presets.csv"
COMPONENTS = {RR: "radial", CC: "circumferential", LL: "longitudinal"}
COARSE, FINE = "12 x 6 x 1", "18 x 9 x 2"
INFARCT = {"segments": [7, 8, 12, 13, 14]}
PRESETS: dict[str, dict[str, Any]] = {
    "dcm": {"preset": "dcm"},
    "hypertension": {"preset": "hypertension"},
    "fresh": {"infarct": INFARCT | {"age": "fresh"}},
    "lbbb": {"activation": {"preset": "lbbb"}},
    "healthy": {},
    "old": {"infarct": INFARCT | {"age": "old"}},
    "rv_pacing": {"activation": {"preset": "rv_pacing"}},
    "normal": {"activation": {"preset": "normal"}},
}
"""Name -> section `pathology`: each of its presets, ages of infarcts and orders of activation."""
HEALTHY = {key: given for key, given in HEARTS.items() if "uniform" in given and not key.startswith("loop.")}


def judged(config: et.Config) -> tuple[str, str]:
    """Status of a heart, as in cases.csv, and the reason."""
    try:
        _, bounded = measured_heart(beat(config), config)
    except ValueError as error:  # of which all refusals of a heart are kinds
        return "failed", str(error)
    reason = violation(bounded, bounds_of(config))
    return "implausible" if reason else "complete", reason


def mesh(elements: str) -> dict[str, int]:
    """Keys of `geometry` of a mesh that is written as `12 x 6 x 1`."""
    names = ("circumferential_elements", "longitudinal_elements", "transmural_elements")
    return dict(zip(names, map(int, elements.split(" x ")), strict=True))


def preset(name: str, species: str, elements: str = COARSE) -> et.Config:
    """Configuration of a heart of the table."""
    loop = {"kind": "circulation", "frames": 24}
    return et.configure(geometry={"preset": species} | mesh(elements), loop=loop, pathology=PRESETS[name])


def preset_row(name: str, species: str, elements: str) -> dict[str, Any]:
    """Row of the table."""
    config = preset(name, species, elements)
    found, values = measured_heart(beat(config), config)
    row = {"species": species, "preset": name, "elements": elements} | {one.key: values.get(one.key) for one in BOUNDS}
    for key, strain in (
        ("segment_radial_strain", found["segment_strain_es"][:, RR]),
        *((f"level_{component}_strain", found["level_strain_es"][:, k]) for k, component in COMPONENTS.items()),
    ):
        row |= {f"{key}_min": strain.min(), f"{key}_max": strain.max()}
    return row


def hearts_of_table(every_species: Iterable[str]) -> list[tuple[str, str, str]]:
    """Species, preset and mesh of the hearts of the table, coarse ones first."""
    return [each[::-1] for each in product((COARSE, FINE), PRESETS, every_species)]


def tabulate_presets(every_species: list[str]) -> None:
    """Solve the hearts that the table does not have, and add a row as soon as it is there."""
    for species, name, elements in hearts_of_table(every_species):
        table = pd.read_csv(TABLE) if TABLE.is_file() else pd.DataFrame(columns=["species", "preset", "elements"])
        if not table[["species", "preset", "elements"]].eq([species, name, elements]).all(axis=1).any():
            row = pd.DataFrame([preset_row(name, species, elements)])
            row.to_csv(TABLE, mode="a", header=table.empty, index=False, float_format="%.4g")
            print(species, name, elements, flush=True)


def count_usable(every_species: list[str], hearts: int) -> None:
    """Judge the first hearts that are drawn of each species."""
    for species in every_species:
        for kind, keys in (("circulation", HEARTS), ("measured", HEALTHY)):
            loop, geometry = {"kind": kind, "frames": 24}, {"preset": species, **mesh(COARSE)}
            draw = {"keys": keys, "number": hearts, "seed": 2}  # 1 served to choose the ranges
            found = Counter[str]()
            for case in et.expand(et.configure(geometry=geometry, loop=loop, cases={"draw": draw})):
                status, reason = judged(case.config)
                found[status] += 1
                print(species, kind, case.id, status, reason, flush=True)
            print(species, kind, dict(found), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("species", nargs="+")
    parser.add_argument("--hearts", type=int, default=50)
    parser.add_argument("--presets", action="store_true")
    arguments = parser.parse_args()
    if arguments.presets:
        tabulate_presets(arguments.species)
    else:
        count_usable(arguments.species, arguments.hearts)


if __name__ == "__main__":
    main()

"""Table of the hearts of config/inference.yaml, drawn at random: muscle that differs from place to place, and infarcts.

    python benchmarks/inference_hearts.py

Each is drawn as docs/inference.md says. The first sixteen are there to learn the errors of trackers on (label `split`
develop), the others to report on (test).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

OUTPUT = Path(__file__).parents[1] / "config/inference_hearts.csv"
SEED = 20261126
DEVELOP, TEST = 16, 60
SEGMENTS = range(1, 18)
INFARCTS = ([7, 8], [9, 10], [11, 12])
"""Neighbouring AHA segments at mid level."""


def normal(random: np.random.Generator, mean: float, sd: float, low: float, high: float) -> float:
    """A number of a normal distribution that is cut off at two limits."""
    while not low <= (number := random.normal(mean, sd)) <= high:
        pass
    return round(float(number), 3)


def heart(random: np.random.Generator) -> dict[str, Any]:
    """Values of one heart by their dotted keys."""
    uniform = lambda low, high: round(float(random.uniform(low, high)), 3)  # noqa: E731
    values = {
        "seed": int(random.integers(1, 1_000_000)),
        "geometry.endo_radius_mm": uniform(1.35, 1.55),
        "geometry.wall_mm": uniform(0.9, 1.1),
        "fibres.endo_deg": normal(random, 80, 8, 60, 90),
        "fibres.epi_deg": normal(random, -38, 8, -60, -25),
        "mechanics.active.sheet_share": uniform(0.26, 0.38),
        "mechanics.active.normal_share": uniform(0.14, 0.22),
        "mechanics.regional.contractility": {number: normal(random, 1, 0.3, 0.3, 2) for number in SEGMENTS},
        "loop.edp_mmHg": uniform(3.5, 6),
        "loop.esp_mmHg": uniform(90, 110),
        "loop.esv_uL": uniform(17, 23),
    }
    if random.random() < 0.5:
        segments = INFARCTS[random.integers(len(INFARCTS))]
        values |= {"pathology.infarct.segments": segments, "pathology.infarct.tension_scale": uniform(0, 0.3)}
    return values


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT)
    arguments = parser.parse_args()
    random = np.random.default_rng(SEED)
    splits = [("develop", number + 1) for number in range(DEVELOP)] + [("test", number + 1) for number in range(TEST)]
    rows = [{"case": f"{split}{number:02}", "label.split": split} | heart(random) for split, number in splits]
    table = pd.DataFrame(rows)
    for name in ("mechanics.regional.contractility", "pathology.infarct.segments"):
        table[name] = [json.dumps(value) if isinstance(value, dict | list) else "" for value in table[name]]
    table.to_csv(arguments.output, index=False)
    print(f"{arguments.output}: {len(table)} hearts")


if __name__ == "__main__":
    main()

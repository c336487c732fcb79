"""True values of what is inferred of a heart."""

from __future__ import annotations

import numpy as np

from echotruth.cases import Case
from echotruth.heart import Heart
from echotruth.inference.draws import MATERIAL, TENSION
from echotruth.inference.segment_means import means_of_cells
from echotruth.repository.reader import Repository
from echotruth.section import value_of
from echotruth.units import kPa, mmHg, uL


def truth(repository: Repository, case: str) -> dict[str, float]:
    """True values of the parameters of a heart that beat, by their names."""
    heart, found = repository.heart(case), repository.case(case)
    return _of_muscle(heart) | _of_keys(found, heart)


def _of_muscle(heart: Heart) -> dict[str, float]:
    """Tension at end-systole and stiffness of segments, relative to the wall, and C and that tension of the wall."""
    arrays, mechanics = heart.arrays["pathology"], heart.arrays["mechanics"]
    segments = heart.arrays["fibres"]["segment"].astype(int)
    tension, volume = means_of_cells(heart.nodes, heart.cells, segments, mechanics["cell_tension"][heart.es])
    stiffness, _ = means_of_cells(heart.nodes, heart.cells, segments, arrays["stiffness_scale"])
    shown, share = np.flatnonzero(volume), volume / volume.sum()
    tension_mean = float(share[shown] @ tension[shown])
    stiffness_mean = float(np.exp(share[shown] @ np.log(stiffness[shown])))
    found = {f"contractility.{place + 1}": tension[place] / tension_mean for place in shown}
    found |= {f"stiffness.{place + 1}": stiffness[place] / stiffness_mean for place in shown}
    found |= {
        MATERIAL: float(mechanics["stiffness"]) * stiffness_mean / kPa,
        TENSION: tension_mean / kPa,
    }
    return {name: float(value) for name, value in found.items()}


def _of_keys(case: Case, heart: Heart) -> dict[str, float]:
    """Values of keys of the configuration, and of the loop at end-diastole and end-systole."""
    pressure, volume = heart.arrays["mechanics"]["pressure"], heart.arrays["mechanics"]["volume"]
    found = {
        "loop.edp_mmHg": pressure[0] / mmHg,
        "loop.esp_mmHg": pressure[heart.es] / mmHg,
        "loop.edv_uL": volume[0] / uL,
        "loop.esv_uL": volume.min() / uL,
    }
    shares = ("mechanics.active.sheet_share", "mechanics.active.normal_share")
    keys = shares if case.config.fibres.source == "file" else (*shares, "fibres.endo_deg", "fibres.epi_deg")
    return {name: float(value) for name, value in found.items()} | {
        name: float(value_of(case.config, name)) for name in keys
    }

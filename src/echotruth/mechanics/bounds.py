"""Bounds on the measures of a heart, within which it is plausible (section `physiology` of the configuration)."""

import csv
from collections.abc import Mapping
from operator import ge, le
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from echotruth.arrays import Floats
from echotruth.config.physiology import Physiology
from echotruth.units import UNITS

COMPONENTS = ("RR", "CC", "LL", "RC", "RL", "CL")
"""Components of strain, in their order."""
RR, CC, LL = range(3)
"""Indices of the normal ones."""


class Bound(NamedTuple):
    """A bound on a measure of the group `physiology`, a row of bounds.csv, or one side of it.

    Attributes
    ----------
    key : str
        Of the section `physiology`; it ends in `min` or `max`, and its unit.
    row : dict
        Measure, the components of it that count, what it is divided by, unit, whether its magnitude counts, whether a
        heart may have no such measure, and its meaning.
    """

    key: str
    row: dict[str, str]

    def most_extreme(self, measured: Mapping[str, ArrayLike]) -> float | None:
        """The most extreme value, in the unit of the key; None where a heart may lack the measure, and does."""
        row = self.row
        found = np.atleast_1d(measured[row["measure"]]).astype(float)
        if row["component"]:
            found = found[..., [COMPONENTS.index(name) for name in row["component"].split()]]
        found = found / (measured[row["over"]] if row["over"] else 1.0) / UNITS.get(row["unit"], 1.0)
        found = np.abs(found) if row["magnitude"] else found
        found = found[np.isfinite(found)] if row["may_lack"] else found
        if not found.size:
            return None
        return float(np.max(found) if "_max" in self.key else np.min(found))


def _bounds() -> tuple[Bound, ...]:
    with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        return tuple(
            Bound("_".join(filter(None, [row["name"], side, row["unit"]])), row)
            for row in csv.DictReader(file)
            for side in row["sides"].split()
        )


BOUNDS = _bounds()
"""Order of checks: accuracy of the solution, strength and pump, motion."""


def tension_variation(tension: Floats) -> float:
    """Total variation of the active tension around the cycle, over that of one rise and one fall of the same height.

    sum |T_(k+1) - T_k| / (2 (max T - min T)), from the last frame to the first too: 1 of a tension that rises once and
    falls once, and more the more it oscillates.

    Parameters
    ----------
    tension : ndarray of shape (frame,), Pa

    Returns
    -------
    float
        1 of a tension that does not change.
    """
    steps, height = np.abs(np.diff(tension, append=tension[0])), np.ptp(tension)
    return 1.0 if height == 0 else float(steps.sum() / (2 * height))


def bounded(measured: Mapping[str, ArrayLike]) -> dict[str, float]:
    """The values of a heart that have bounds, in the unit of their keys.

    Parameters
    ----------
    measured : dict of ndarray
        As :func:`measures` returns it; `active_tension` (frame,), Pa, of the group `mechanics`; and `edv_of_healthy`,
        the end-diastolic volume over that of the heart without its disease.

    Returns
    -------
    dict
        Key of the section `physiology` -> the most extreme value; none of what a heart may lack and this one does.
    """
    known = {**measured, "tension_variation": tension_variation(np.asarray(measured["active_tension"]))}
    values = {bound.key: bound.most_extreme(known) for bound in BOUNDS}
    return {key: value for key, value in values.items() if value is not None}


def violation(values: dict[str, float], bounds: Physiology) -> str:
    """The first bound that values violate, in one sentence; empty where there is none. Not a number violates any.

    Parameters
    ----------
    values : dict
        As :func:`bounded` returns them.
    bounds : Physiology
    """
    for bound in BOUNDS:
        limit = getattr(bounds, bound.key)
        if limit is None or bound.key not in values:
            continue
        holds, rule = (le, "at most") if "_max" in bound.key else (ge, "at least")
        if not holds(values[bound.key], limit):
            # As many digits as show that it does.
            texts = (f"{values[bound.key]:.{digits}g}" for digits in range(3, 18))
            value = next(text for text in texts if not holds(float(text), limit)).replace("nan", "not a number")
            return f"{bound.row['meaning']} is {value} and must be {rule} {limit:g} (physiology.{bound.key})."
    return ""

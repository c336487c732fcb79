"""Measures of a solved heart, and the bounds within which it is plausible."""

from __future__ import annotations

from math import degrees
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from echotruth.config.physiology import Physiology
from echotruth.mechanics.twist import twist

Arrays = dict[str, NDArray]

CC, LL = 1, 2
"""Index of the circumferential and the longitudinal component of strain."""


class Bound(NamedTuple):
    """A bound on a measure.

    Attributes
    ----------
    key : str
        Of the section `physiology`; it ends in `min` or `max`, and its unit.
    measure : str
        Array of the group `physiology`; the most extreme value counts.
    description : str
    factor : float
        Measure in SI units to the unit of the key.
    """

    key: str
    measure: str
    description: str
    factor: float = 1.0


BOUNDS = (
    Bound("loop_error_max", "loop_error", "the largest relative error of pressure or volume"),
    Bound("volume_ratio_min", "volume_ratio_min", "the smallest det F of all points and frames"),
    Bound("longitudinal_strain_max", "longitudinal_strain", "the mean longitudinal strain at end-systole"),
    Bound("twist_max_deg", "twist", "the largest twist (deg)", degrees(1)),
    Bound("ejection_fraction_min", "ejection_fraction", "the ejection fraction"),
    Bound("ejection_fraction_max", "ejection_fraction", "the ejection fraction"),
    Bound("tension_min_kPa", "tension_min", "the smallest active tension (kPa)", 1e-3),
    Bound("tension_es_min_kPa", "tension_es", "the active tension at end-systole (kPa)", 1e-3),
    Bound("tension_es_max_kPa", "tension_es", "the active tension at end-systole (kPa)", 1e-3),
)
"""Order of checks: accuracy of the solution, then plausibility."""


def measures(geometry: Arrays, mechanics: Arrays, kinematics: Arrays) -> Arrays:
    """Measure a solved heart.

    Parameters
    ----------
    geometry, mechanics, kinematics : dict of ndarray
        Arrays of these groups, as docs/schema.md lists them.

    Returns
    -------
    dict of ndarray
        The group `physiology`: `twist` (frame,) in rad, and numbers: strains at end-systole, ejection fraction,
        smallest det F, largest relative error of the prescribed pressure and volume, tensions in Pa. For a prescribed
        motion ejection fraction and tensions are not a number, and the error is 0.
    """
    es, volume = int(mechanics["es_frame"]), mechanics["volume"]
    strain, tension = kinematics["strain_mean"][es], mechanics["active_tension"]
    positions = geometry["node_position"] + mechanics["displacement"]
    return {
        "twist": twist(geometry["node_position"], geometry["endo"], positions),
        "longitudinal_strain": strain[LL],
        "circumferential_strain": strain[CC],
        "ejection_fraction": np.asarray(1 - volume.min() / volume[0]),
        "volume_ratio_min": kinematics["volume_ratio_min"].min(),
        "loop_error": np.asarray(max(_largest_error(mechanics, quantity) for quantity in ("pressure", "volume"))),
        "tension_min": tension.min(),
        "tension_es": tension[es],
    }


def violated_bound(measured: dict[str, ArrayLike], bounds: Physiology) -> str:
    """The first bound that a heart violates, in one sentence; empty where there is none.

    Parameters
    ----------
    measured : dict of ndarray
        As :func:`measures` returns it.
    bounds : Physiology
    """
    for bound in BOUNDS:
        limit, values = getattr(bounds, bound.key), bound.factor * np.atleast_1d(measured[bound.measure])
        if limit is None:
            continue
        if "_max" in bound.key:
            value = np.max(np.abs(values)) if bound.measure == "twist" else np.max(values)
            violated, rule = not value <= limit, "at most"
        else:
            value = np.min(values)
            violated, rule = not value >= limit, "at least"
        if violated:
            return f"{bound.description} is {value:.3g} and must be {rule} {limit:g} (physiology.{bound.key})."
    return ""


def _largest_error(mechanics: Arrays, quantity: str) -> float:
    """Largest relative error of a quantity where it has a target; 0 where it has none."""
    solved, target = mechanics[quantity], mechanics[f"{quantity}_target"]
    prescribed = np.isfinite(target)
    return float(np.max(np.abs(solved[prescribed] / target[prescribed] - 1), initial=0.0))

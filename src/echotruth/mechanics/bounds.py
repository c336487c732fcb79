"""Bounds on the measures of a heart, within which it is plausible (section `physiology` of the configuration)."""

from collections.abc import Callable, Mapping
from operator import ge, itemgetter, le
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from echotruth.arrays import Floats
from echotruth.config.physiology import Physiology
from echotruth.units import UNITS

RR, CC, LL, RC, RL, CL = range(6)
"""Indices of the components of strain."""


class Bound(NamedTuple):
    """A bound on a measure.

    Attributes
    ----------
    key : str
        Of the section `physiology`; it ends in `min` or `max`, and its unit.
    description : str
    value : callable
        Values of the group `physiology`, or of what they leave out, in the unit of the key; the most extreme counts.
    """

    key: str
    description: str
    value: Callable[[Mapping[str, ArrayLike]], ArrayLike]

    @property
    def may_lack(self) -> bool:
        """Whether a heart may have no such measure, so that one that is not a number violates nothing."""
        names = ("_ivc_", "tei_index", "filling_ratio", "fibre_strain_spread", "segment_", "edv_of_healthy")
        return any(name in self.key for name in names)


def _at(measure: str, component: int | list[int]) -> Callable[[Mapping[str, ArrayLike]], ArrayLike]:
    return lambda measured: np.asarray(measured[measure])[..., component]


def _in_degrees(measure: str) -> Callable[[Mapping[str, ArrayLike]], ArrayLike]:
    return lambda measured: np.degrees(measured[measure])


def _in(unit: str, measure: str, over: str | None = None) -> Callable[[Mapping[str, ArrayLike]], ArrayLike]:
    """A measure, or one over another, in a unit."""
    return lambda measured: np.asarray(measured[measure]) / (measured[over] if over else 1.0) / UNITS[unit]


def _magnitude(value: Callable[[Mapping[str, ArrayLike]], ArrayLike]) -> Callable[[Mapping[str, ArrayLike]], ArrayLike]:
    return lambda measured: np.abs(value(measured))


def _range(name: str, unit: str, description: str, value: Callable) -> tuple[Bound, Bound]:
    """Bounds on both sides; `unit` is the suffix of their keys."""
    low, high = (Bound(f"{name}_{side}{unit}", description, value) for side in ("min", "max"))
    return low, high


_IVC, _ES = "at the end of isovolumic contraction", "at end-systole"
_OUTPUT = _in("mL_per_min_per_g", "cardiac_output", "wall_mass")
BOUNDS = (
    Bound("loop_error_max", "the largest relative error of pressure or volume", itemgetter("loop_error")),
    Bound("volume_ratio_min", "the smallest det F of all points and frames", itemgetter("volume_ratio_min")),
    Bound(
        "volume_change_rms_max",
        f"the root mean square of det F - 1 {_ES}",
        itemgetter("volume_change_rms"),
    ),
    Bound("longitudinal_strain_max", f"the mean longitudinal strain {_ES}", itemgetter("longitudinal_strain")),
    Bound("twist_max_deg", "the largest twist (deg)", _magnitude(_in_degrees("twist"))),
    *_range("ejection_fraction", "", "the ejection fraction", itemgetter("ejection_fraction")),
    Bound("tension_min_kPa", "the smallest active tension (kPa)", _in("kPa", "tension_min")),
    Bound(
        "tension_variation_max",
        "the total variation of the active tension over that of one rise and fall",
        lambda measured: tension_variation(np.asarray(measured["active_tension"])),
    ),
    *_range("tension_es", "_kPa", f"the active tension {_ES} (kPa)", _in("kPa", "tension_es")),
    *_range("edp", "_mmHg", "the end-diastolic pressure (mmHg)", _in("mmHg", "edp")),
    Bound("edv_of_healthy_min", "the volume at end-diastole over the healthy one", itemgetter("edv_of_healthy")),
    *_range(
        "edv_per_mass",
        "_mL_per_g",
        "the volume at end-diastole over the mass (mL/g)",
        _in("mL_per_g", "edv", "wall_mass"),
    ),
    *_range("output_per_mass", "_mL_per_min_per_g", "the cardiac output over the mass (mL/min/g)", _OUTPUT),
    *_range("wall_mass", "_g", "the mass of the wall (g)", _in("g", "wall_mass")),
    *_range("twist_ivc", "_deg", f"the twist {_IVC} (deg)", _in_degrees("twist_ivc")),
    *_range("twist_es", "_deg", f"the twist {_ES} (deg)", _in_degrees("twist_es")),
    Bound("radial_strain_ivc_max", f"the mean radial strain {_IVC}", _at("strain_ivc", RR)),
    Bound(
        "transmural_shear_ivc_max",
        f"the largest mean of E_RC or E_RL over a layer {_IVC}",
        _magnitude(_at("layer_strain_ivc", [RC, RL])),
    ),
    Bound(
        "level_circumferential_strain_ivc_max",
        f"the largest mean of E_CC over a level, in either direction, {_IVC}",
        _magnitude(_at("level_strain_ivc", CC)),
    ),
    Bound(
        "segment_circumferential_strain_ivc_max",
        f"the largest mean of E_CC over an AHA segment, in either direction, {_IVC}",
        _magnitude(_at("segment_strain_ivc", CC)),
    ),
    Bound(
        "level_radial_strain_ivc_max",
        f"the largest mean of E_RR over a level {_IVC}",
        _at("level_strain_ivc", RR),
    ),
    Bound(
        "level_fibre_strain_ivc_max",
        f"the largest mean strain along the fibres of a level, in either direction, {_IVC}",
        _magnitude(itemgetter("level_fibre_strain_ivc")),
    ),
    Bound(
        "fibre_shortening_rate_max_per_s",
        "the fastest shortening of the fibres of a level (1/s)",
        itemgetter("fibre_shortening_rate"),
    ),
    Bound(
        "fibre_strain_spread_max",
        f"the spread of the strain along the fibres over the wall {_ES}",
        itemgetter("fibre_strain_spread"),
    ),
    *_range("circumferential_strain", "", f"the mean circumferential strain {_ES}", _at("strain_es", CC)),
    *_range("radial_strain", "", f"the mean radial strain {_ES}", _at("strain_es", RR)),
    *_range("segment_circumferential_strain", "", f"E_CC of an AHA segment {_ES}", _at("segment_strain_es", CC)),
    *_range("segment_longitudinal_strain", "", f"E_LL of an AHA segment {_ES}", _at("segment_strain_es", LL)),
    *_range("gls", "", "the global longitudinal strain", itemgetter("gls")),
    *_range("torsional_shear", "", f"the mean shear strain E_CL {_ES}", _at("strain_es", CL)),
    *_range("tei_index", "", "the Tei index", itemgetter("tei_index")),
    *_range("filling_ratio", "", "the ratio E/A of the rates of filling", itemgetter("filling_ratio")),
)
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
    values = {}
    for bound in BOUNDS:
        found = np.atleast_1d(bound.value(measured)).astype(float)
        if bound.may_lack:
            found = found[np.isfinite(found)]
        if found.size:
            values[bound.key] = float(np.max(found) if "_max" in bound.key else np.min(found))
    return values


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
            return f"{bound.description} is {value} and must be {rule} {limit:g} (physiology.{bound.key})."
    return ""

"""Measures of a solved heart, and the bounds within which it is plausible."""

from __future__ import annotations

from collections.abc import Callable
from operator import ge, itemgetter, le
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.config.physiology import Physiology
from echotruth.fem.tetrahedra import Mesh
from echotruth.loop.cycle import read_loop
from echotruth.loop.haemodynamics import intervals, pressure_rates
from echotruth.loop.phases import CONTRACTION, FILLING
from echotruth.mechanics.contours import MID_SLICE, global_longitudinal_strain, wall_thickness
from echotruth.mechanics.fibres import wall_depth
from echotruth.mechanics.geometry import epicardial_apex
from echotruth.mechanics.geometry.boundary import area_vectors
from echotruth.mechanics.history import Arrays
from echotruth.mechanics.twist import APICAL_SLICE, BASAL_SLICE, rotation

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
        Values of the group `physiology`, or of a course that they leave out, in the unit of the key; the most extreme
        counts.
    healthy : bool
        Whether it is that of healthy hearts alone; what could not be measured violates no such bound.
    """

    key: str
    description: str
    value: Callable[[dict[str, ArrayLike]], ArrayLike]
    healthy: bool = False


def _at(measure: str, component: int) -> Callable[[dict[str, ArrayLike]], ArrayLike]:
    return lambda measured: np.asarray(measured[measure])[..., component]


def _in_degrees(measure: str) -> Callable[[dict[str, ArrayLike]], ArrayLike]:
    return lambda measured: np.degrees(measured[measure])


def _in_kPa(measure: str) -> Callable[[dict[str, ArrayLike]], ArrayLike]:
    return lambda measured: np.asarray(measured[measure]) / 1e3


def _range(name: str, unit: str, description: str, value: Callable, healthy: bool) -> tuple[Bound, Bound]:
    """Bounds on both sides; `unit` is the suffix of their keys."""
    low, high = (Bound(f"{name}_{side}{unit}", description, value, healthy) for side in ("min", "max"))
    return low, high


_IVC, _ES = "at the end of isovolumic contraction", "at end-systole"
BOUNDS = (
    Bound("loop_error_max", "the largest relative error of pressure or volume", itemgetter("loop_error")),
    Bound("volume_ratio_min", "the smallest det F of all points and frames", itemgetter("volume_ratio_min")),
    Bound("longitudinal_strain_max", f"the mean longitudinal strain {_ES}", itemgetter("longitudinal_strain")),
    Bound("twist_max_deg", "the largest twist (deg)", lambda measured: np.abs(np.degrees(measured["twist"]))),
    *_range("ejection_fraction", "", "the ejection fraction", itemgetter("ejection_fraction"), False),
    Bound("tension_min_kPa", "the smallest active tension (kPa)", _in_kPa("tension_min")),
    Bound(
        "tension_variation_max",
        "the total variation of the active tension over that of one rise and fall",
        lambda measured: tension_variation(np.asarray(measured["active_tension"])),
    ),
    *_range("tension_es", "_kPa", f"the active tension {_ES} (kPa)", _in_kPa("tension_es"), False),
    *_range("twist_ivc", "_deg", f"the twist {_IVC} (deg)", _in_degrees("twist_ivc"), True),
    *_range("twist_es", "_deg", f"the twist {_ES} (deg)", _in_degrees("twist_es"), True),
    Bound("radial_strain_ivc_max", f"the mean radial strain {_IVC}", _at("strain_ivc", RR), True),
    Bound(
        "transmural_shear_ivc_max",
        f"the largest mean of E_RC or E_RL over a layer {_IVC}",
        lambda measured: np.abs(np.asarray(measured["layer_strain_ivc"])[..., [RC, RL]]),
        True,
    ),
    *_range("circumferential_strain", "", f"the mean circumferential strain {_ES}", _at("strain_es", CC), True),
    *_range("gls", "", "the global longitudinal strain", itemgetter("gls"), True),
    *_range("torsional_shear", "", f"the mean shear strain E_CL {_ES}", _at("strain_es", CL), True),
    *_range("tei_index", "", "the Tei index", itemgetter("tei_index"), True),
)
"""Order of checks: accuracy of the solution, what no heart does, what no healthy heart does."""


def measures(geometry: Arrays, mechanics: Arrays, kinematics: Arrays, depth: Floats | None = None) -> Arrays:
    """Measure the motion of a heart.

    Parameters
    ----------
    geometry, mechanics, kinematics : dict of ndarray
        Arrays of these groups, as docs/schema.md lists them, and `time` (frame,), s, in `mechanics`.
    depth : ndarray of shape (n_nodes,), optional
        Wall depth, `wall_depth` of the group `fibres`; computed from the geometry if not given.

    Returns
    -------
    dict of ndarray
        The group `physiology`, in SI units; docs/conventions.md defines its quantities. What a prescribed motion does
        not have, such as phases, pressures and tensions, is not a number.
    """
    mesh = Mesh(*(geometry[name] for name in ("node_position", "cell_node", "endo", "epi", "base")))
    positions = mesh.nodes + mechanics["displacement"]
    volume, tension, es = mechanics["volume"], mechanics["active_tension"], int(mechanics["es_frame"])
    return {
        **_rotations(mesh, positions, mechanics),
        **_strains(kinematics, mechanics),
        **_axial_motion(mesh, mechanics["displacement"]),
        **_lengths(mesh, wall_depth(mesh) if depth is None else depth, positions[[0, es]]),
        **_times(mechanics),
        "ejection_fraction": np.asarray(1 - volume.min() / volume[0]),
        "volume_ratio_min": kinematics["volume_ratio_min"].min(),
        "loop_error": np.asarray(max(_largest_error(mechanics, quantity) for quantity in ("pressure", "volume"))),
        "tension_min": tension.min(),
        "tension_es": tension[es],
    }


def measured_heart(groups: dict[str, Arrays], config: Config) -> tuple[Arrays, dict[str, float]]:
    """Measure a heart that was simulated.

    Parameters
    ----------
    groups : dict of dict of ndarray
        As :func:`echotruth.mechanics.beat.simulate` returns them.
    config : Config

    Returns
    -------
    measures : dict of ndarray
        The group `physiology`.
    bounded : dict
        As :func:`bounded` returns it; empty for prescribed motions, to which the bounds do not apply.
    """
    mechanics = groups["mechanics"] | {"time": read_loop(config.loop).time}
    found = measures(groups["geometry"], mechanics, groups["kinematics"], groups["fibres"]["wall_depth"])
    if config.motion.kind != "beat":
        return found, {}
    healthy = not groups["pathology"]["region"].any()
    return found, bounded({**found, "active_tension": mechanics["active_tension"]}, healthy)


def _rotations(mesh: Mesh, positions: Floats, mechanics: Arrays) -> Arrays:
    base, apex = (rotation(mesh.nodes, mesh.endo, positions, centre) for centre in (BASAL_SLICE, APICAL_SLICE))
    twist, es, time = apex - base, int(mechanics["es_frame"]), mechanics["time"]
    filling = mechanics["phase"] == FILLING
    # Filling unwinds; a prescribed motion has no other phase, and its peak is that of the cycle.
    peak = int(np.argmax(np.where(filling & ~filling.all(), 0.0, np.abs(twist))))
    return {
        "rotation_base": base,
        "rotation_apex": apex,
        "twist": twist,
        "twist_ivc": _at_end_of_ivc(twist, mechanics["phase"]),
        "twist_es": twist[es],
        "twist_peak": twist[peak],
        "twist_peak_delay": time[peak] - time[es],
    }


def _strains(kinematics: Arrays, mechanics: Arrays) -> Arrays:
    es, phase = int(mechanics["es_frame"]), mechanics["phase"]
    mean, layers = kinematics["strain_mean"], kinematics["layer_strain"]
    return {
        "strain_ivc": _at_end_of_ivc(mean, phase),
        "strain_es": mean[es],
        "layer_strain_ivc": _at_end_of_ivc(layers, phase),
        "layer_strain_es": layers[es],
        "longitudinal_strain": mean[es, LL],
        "circumferential_strain": mean[es, CC],
    }


def _at_end_of_ivc(values: Floats, phase: NDArray[np.uint8]) -> Floats:
    """Values (frame, ...) in the last frame of isovolumic contraction; not a number where there is none."""
    frames = np.flatnonzero(phase == CONTRACTION)
    return values[frames[-1]] if len(frames) else np.full(values.shape[1:], np.nan)


def _axial_motion(mesh: Mesh, displacement: Floats) -> Arrays:
    """Motion of the epicardial apex, and of the base (area mean), along the long axis since ED."""
    axial = displacement[..., 2] - displacement[0, :, 2]
    area = np.linalg.norm(area_vectors(mesh.nodes, mesh.base), axis=-1)
    # The mean of a quadratic over a triangle is that of its mid-edge nodes.
    base = np.average(axial[:, mesh.base[:, 3:]].mean(axis=-1), axis=1, weights=area)
    return {"apex_motion": axial[:, epicardial_apex(mesh)], "base_motion": base}


def _lengths(mesh: Mesh, depth: Floats, positions: Floats) -> Arrays:
    """Thickening of the wall in a plane that stays, and global longitudinal strain, from positions at ED and ES."""
    ed, es = positions
    height = MID_SLICE * ed[mesh.endo, 2].min()
    thin, thick = (wall_thickness(mesh.endo, mesh.epi, at, height) for at in (ed, es))
    return {
        "wall_thickening": np.asarray(thick / thin - 1),
        "gls": np.asarray(global_longitudinal_strain(depth, mesh.cells, ed, es)),
    }


def _times(mechanics: Arrays) -> Arrays:
    time, pressure = mechanics["time"], mechanics["pressure"]
    phases = intervals(time, mechanics["volume"], mechanics["phase"])
    rates = pressure_rates(time, pressure, phases.mitral_opening)
    numbers = {
        "ivc_time": phases.ivc,
        "ejection_time": phases.ejection,
        "ivr_time": phases.ivr,
        "tei_index": phases.tei,
        **rates._asdict(),
    }
    return {name: np.asarray(number) for name, number in numbers.items()}


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


def bounded(measured: dict[str, ArrayLike], healthy: bool = True) -> dict[str, float]:
    """The values of a heart that have bounds, in the unit of their keys.

    Parameters
    ----------
    measured : dict of ndarray
        As :func:`measures` returns it, and `active_tension` (frame,), Pa, of the group `mechanics`.
    healthy : bool, optional
        Whether the bounds of healthy hearts apply too; not to a heart with an infarct or late activation.

    Returns
    -------
    dict
        Key of the section `physiology` -> the most extreme value; none of what could not be measured, and not a number
        where there is no healthy bound to violate.
    """
    values = {}
    for bound in BOUNDS:
        found = np.atleast_1d(bound.value(measured)).astype(float)
        if bound.healthy:
            found = found[np.isfinite(found)]
        if found.size and (healthy or not bound.healthy):
            values[bound.key] = float(np.max(found) if "_max" in bound.key else np.min(found))
    return values


def violated_bound(measured: dict[str, ArrayLike], bounds: Physiology, healthy: bool = True) -> str:
    """The first bound that a heart violates, in one sentence; empty where there is none; parameters as of `bounded`."""
    return violation(bounded(measured, healthy), bounds)


def violation(values: dict[str, float], bounds: Physiology) -> str:
    """The first bound that values violate, in one sentence; empty where there is none.

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
            value = values[bound.key]
            return f"{bound.description} is {value:.3g} and must be {rule} {limit:g} (physiology.{bound.key})."
    return ""


def _largest_error(mechanics: Arrays, quantity: str) -> float:
    """Largest relative error of a quantity where it has a target; 0 where it has none."""
    solved, target = mechanics[quantity], mechanics[f"{quantity}_target"]
    prescribed = np.isfinite(target)
    return float(np.max(np.abs(solved[prescribed] / target[prescribed] - 1), initial=0.0))

"""Measures of a solved heart; the bounds within which it is plausible stand in :mod:`.bounds`."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import APEX_SEGMENT, segment
from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.fem.tetrahedra import Mesh, shape
from echotruth.fem.volume import cell_volumes
from echotruth.heart import in_right_wall
from echotruth.loop.cycle import heart_cycle
from echotruth.loop.haemodynamics import filling_ratio, intervals, pressure_rates
from echotruth.loop.phases import CONTRACTION, FILLING, RELAXATION
from echotruth.mechanics.bounds import CC, LL, bounded
from echotruth.mechanics.contours import MID_SLICE, global_longitudinal_strain, wall_thickness
from echotruth.mechanics.fibres import CENTROID, wall_depth
from echotruth.mechanics.geometry import epicardial_apex
from echotruth.mechanics.geometry.boundary import area_vectors, boundary
from echotruth.mechanics.kinematics import group_means
from echotruth.mechanics.outputs import Arrays
from echotruth.mechanics.twist import APICAL_SLICE, BASAL_SLICE, rotation

OF_CLIP = (
    *("rotation_base", "rotation_apex", "twist", "apex_motion", "base_motion"),
    *("volume_ratio_min", "loop_error", "tension_min"),
)
"""Measures of all frames, where the others are those of the first beat: curves, and what a bad solution shows in."""

DENSITY = 1050.0
"""Of heart muscle, kg/m^3: 1.05 g/mL, by which MRI turns the volume of a wall into its mass (Petersen 2017, doi
10.1186/s12968-017-0327-9)."""


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
    depth = wall_depth(mesh) if depth is None else depth
    is_right = in_right_wall(depth, mesh.cells)
    mesh, strain = _left_ventricle(mesh, depth, is_right), kinematics["strain"][:, ~is_right]
    positions = mesh.nodes + mechanics["displacement"]
    tension, es = mechanics["active_tension"], int(mechanics["es_frame"])
    return {
        **_rotations(mesh, positions, mechanics),
        **_strains(kinematics | {"segment_strain": _segment_strain(mesh, strain)}, mechanics),
        **_axial_motion(mesh, mechanics["displacement"]),
        **_lengths(mesh, depth, positions[[0, es]]),
        **_times(mechanics),
        **_pump(mesh, mechanics),
        "volume_ratio_min": kinematics["volume_ratio_min"].min(),
        "volume_change_rms": kinematics["volume_change_rms"][es],
        "loop_error": np.asarray(max(_largest_error(mechanics, quantity) for quantity in ("pressure", "volume"))),
        "tension_min": tension.min(),
        "tension_es": tension[es],
    }


def _left_ventricle(mesh: Mesh, depth: Floats, is_right: NDArray[np.bool_]) -> Mesh:
    """The left ventricle of a mesh, without the cells (n_cells,) of the free wall of a right one."""
    if not is_right.any():
        return mesh
    cells = mesh.cells[~is_right]
    facets, _ = boundary(cells)
    epi, base = facets[(depth[facets] == 1).all(axis=1)], mesh.base[(depth[mesh.base] <= 1).all(axis=1)]
    return replace(mesh, cells=cells, epi=epi, base=base)


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
        The group `physiology`: of the first beat, but for `OF_CLIP`.
    bounded : dict
        As :func:`bounded` returns it; empty for prescribed motions, to which the bounds do not apply.
    """
    loop, geometry, depth = heart_cycle(config), groups["geometry"], groups["fibres"]["wall_depth"]
    mechanics, kinematics = groups["mechanics"] | {"time": loop.time}, groups["kinematics"]
    found = measures(geometry, mechanics, kinematics, depth)
    if len(loop.beats) > 1:
        of_clip, first = {name: found[name] for name in OF_CLIP}, loop.beats[0]
        found = measures(geometry, _cut(mechanics, first), _cut(kinematics, first), depth) | of_clip
    if config.motion.kind != "beat":
        return found, {}
    # With a given stiffness, what the healthy heart holds follows from it, and is not that of the loop.
    is_held = loop.volume is not None and config.mechanics.material.stiffness_kPa is None
    healthy = loop.edv if is_held else np.nan
    others = {"active_tension": mechanics["active_tension"][loop.beats[0]], "edv_of_healthy": found["edv"] / healthy}
    return found, bounded(found | others)


def _cut(group: Arrays, frames: slice) -> Arrays:
    """Arrays of a group in some frames, which are the first dimension of all that have one."""
    return {name: values[frames] if values.ndim else values for name, values in group.items()}


def _pump(mesh: Mesh, mechanics: Arrays) -> Arrays:
    """What the heart holds, weighs and puts out."""
    volume, time = mechanics["volume"], mechanics["time"]
    stroke, period = volume[0] - volume.min(), 2 * time[-1] - time[-2]
    return {
        "edv": volume[0],
        "edp": mechanics["pressure"][0],
        "stroke_volume": stroke,
        "ejection_fraction": stroke / volume[0],
        "cardiac_output": stroke / period,
        "wall_mass": DENSITY * cell_volumes(mesh.nodes, mesh.cells).sum(),
    }


def _segment_strain(mesh: Mesh, strain: Floats) -> Floats:
    """Mean (frame, segment, 6) of the strain (frame, cell, 6) at the centroids over the cells of each AHA segment."""
    segments = segment(shape(CENTROID)[0] @ mesh.nodes[mesh.cells], mesh.nodes[mesh.endo, 2].min())
    return group_means(strain, cell_volumes(mesh.nodes, mesh.cells), segments, APEX_SEGMENT)


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
        **_untwisting(twist, mechanics),
    }


def _untwisting(twist: Floats, mechanics: Arrays) -> Arrays:
    """Share of the twist at ES that is given back in isovolumic relaxation, and the fastest untwisting (rad/s)."""
    es, time = int(mechanics["es_frame"]), mechanics["time"]
    relaxing = np.flatnonzero(mechanics["phase"] == RELAXATION)
    given_back = (twist[es] - twist[relaxing[-1]]) / twist[es] if len(relaxing) and twist[es] else np.nan
    rates = np.diff(twist[es:]) / np.diff(time[es:])
    return {"untwist_ivr": np.asarray(given_back), "untwist_rate": np.asarray(-rates.min(initial=0.0))}


def _strains(kinematics: Arrays, mechanics: Arrays) -> Arrays:
    es, phase = int(mechanics["es_frame"]), mechanics["phase"]
    parts = ("layer_strain", "level_strain", "segment_strain", "level_fibre_strain")
    names = {"strain": "strain_mean"} | {name: name for name in parts}
    ends: Arrays = {}
    for name, array in names.items():
        ends |= {f"{name}_ivc": _at_end_of_ivc(kinematics[array], phase), f"{name}_es": kinematics[array][es]}
    mean = kinematics["strain_mean"][es]
    return {
        **ends,
        "longitudinal_strain": mean[LL],
        "circumferential_strain": mean[CC],
        "fibre_strain_spread": _spread(kinematics["fibre_strain_mean"][es], kinematics["fibre_strain_sd"][es]),
        "fibre_shortening_rate": fastest_shortening(kinematics["level_fibre_strain"], mechanics["time"]),
    }


def _spread(mean: Floats, sd: Floats) -> Floats:
    return np.asarray(sd / abs(mean) if mean else np.nan)


def fastest_shortening(strain: Floats, time: Floats) -> Floats:
    """Fastest shortening of the fibres of a level between two frames.

    Parameters
    ----------
    strain : ndarray of shape (n_frames, n_levels)
        Green-Lagrange strain E along the fibres since ED, whose stretch is sqrt(1 + 2 E).
    time : ndarray of shape (n_frames,), s

    Returns
    -------
    ndarray of shape (), 1/s
        In lengths at ED; 0 where nothing shortens.
    """
    rate = np.diff(np.sqrt(1 + 2 * strain), axis=0) / np.diff(time)[:, None]
    return np.asarray(-np.nanmin(rate, initial=0.0))


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
        "filling_ratio": filling_ratio(time, mechanics["volume"], mechanics["phase"]),
        **rates._asdict(),
    }
    return {name: np.asarray(number) for name, number in numbers.items()}


def _largest_error(mechanics: Arrays, quantity: str) -> float:
    """Largest relative error of a quantity where it has a target; 0 where it has none."""
    solved, target = mechanics[quantity], mechanics[f"{quantity}_target"]
    prescribed = np.isfinite(target)
    return float(np.max(np.abs(solved[prescribed] / target[prescribed] - 1), initial=0.0))

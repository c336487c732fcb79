"""Tissue: stiffness and active tension of every cell of the wall, healthy or diseased."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.config import Config, Pathology
from echotruth.config.pathology import Infarct
from echotruth.config.regional import Regional
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import NODE_XI, Floats, MaterialPoints, Mesh, interpolate, shape
from echotruth.heart import in_right_wall
from echotruth.mechanics.fibres import material_gradients, wall_depth
from echotruth.units import deg, mm

HEALTHY, INFARCT, BORDER, LATE = range(4)
"""Regions; where they overlap, infarct takes precedence over border zone, and border zone over late activation."""

_WALLS = {(1, 7, 13): 1.05, (2, 3, 8, 9, 14): 0.9, (4, 10, 15): 0.87, (5, 6, 11, 12, 16): 1.2, (17,): 1.0}
_LEVELS = {range(1, 7): 0.95, range(7, 13): 1.0, range(13, 18): 1.05}
CONTRACTILITY = {
    number: wall * level
    for segments, wall in _WALLS.items()
    for number in segments
    for numbers, level in _LEVELS.items()
    if number in numbers
}
"""AHA segment -> contractility of a healthy heart: a factor of its wall times one of its level.

Tagging of 39 people without heart disease ("Characterization of normal regional myocardial function by MRI cardiac
tagging", sine wave modelling) finds E_CC of -20.2 % in the anterior and -21.8 % in the lateral wall, and -17.2, -20.1
and -20.3 % at base, mid and apex, which leaves -17.4 % for septum and inferior wall; in another 31 the anterolateral
wall shortens most too (Moore 2000, doi 10.1148/radiology.214.2.r00fe17453). With these factors the walls of a body of
revolution shorten in about the same proportions, 1.06, 0.90, 0.91 and 1.13 of their mean, and the base by 0.88 of the
middle.
"""

_SAMPLES = np.array([(i, j, k) for i in range(5) for j in range(5 - i) for k in range(5 - i - j)]) / 4
"""Local coordinates at which a cell is sampled: corners, quarters of edges, ..., and the centroid."""

_CENTROID = int(np.flatnonzero((_SAMPLES == 0.25).all(axis=1))[0])


class PathologyError(ValueError):
    """Raised if no cell of the heart has the pathology of the configuration."""


@dataclass(frozen=True)
class Tissue:
    """Material properties of the cells.

    Attributes
    ----------
    region : ndarray of shape (n_cells,), uint8
        0 healthy, 1 infarct, 2 border zone, 3 late activation (:mod:`.activation_map`).
    stiffness_scale, tension_scale : ndarray of shape (n_cells,)
        Factors on the stiffness of the passive law and on the active tension; 1 is healthy.
    activation_delay : ndarray of shape (n_cells,), s
    taut_stiffness : ndarray of shape (n_cells,), Pa
        Stiffness in addition from end-diastole on.
    """

    region: NDArray[np.uint8]
    stiffness_scale: Floats
    tension_scale: Floats
    activation_delay: Floats
    taut_stiffness: Floats


def healthy_heart(config: Config) -> Config:
    """The configuration of a heart without what `loop.kind: circulation` takes for its disease."""
    geometry = config.geometry.model_copy(update={"hypertrophy": 1.0, "dilation": 1.0})
    fibres = config.fibres.model_copy(update={"disarray_deg": 0.0})
    return config.model_copy(update={"geometry": geometry, "fibres": fibres, "pathology": Pathology()})


def tissue(mesh: Mesh, depth: Floats, pathology: Pathology, regional: Regional) -> Tissue:
    """Properties of the cells of a heart, by the position of their centroids.

    Parameters
    ----------
    mesh : Mesh
    depth : ndarray of shape (n_nodes,)
        Wall depth.
    pathology : Pathology
    regional : Regional
        Its factors multiply those of the pathology.

    Returns
    -------
    Tissue
        All activated at once. Regional factors of a segment are those of its middle, and in between they change
        linearly around the long axis; from level to level they do not.

    Raises
    ------
    PathologyError
        If no cell has its centroid in the infarct.
    """
    infarct, scar = pathology.infarct, pathology.infarct.scar()
    centroid = shape(_SAMPLES)[_CENTROID] @ mesh.nodes[mesh.cells]
    is_left = ~in_right_wall(depth, mesh.cells)
    segments = segment(centroid, _apex(mesh)) * is_left
    given = regional.stiffness, regional.contractility, CONTRACTILITY if regional.preset == "normal" else {}
    of_stiffness, of_tension, healthy = (_gradual(_by_segment(one), segments, centroid) for one in given)
    weight = _infarct_weight(mesh, depth, infarct) * is_left
    region = np.select([weight == 1, weight > 0], [INFARCT, BORDER], HEALTHY).astype(np.uint8)
    stiffness = 1 + (scar["stiffness_scale"] - 1) * weight
    remote = infarct.remote_tension_scale if weight.any() else 1.0
    tension = remote * (1 - weight) + infarct.tension_scale * weight
    taut = 1e3 * scar["taut_stiffness_kPa"] * weight
    return Tissue(region, stiffness * of_stiffness, tension * of_tension * healthy, np.zeros(len(weight)), taut)


def thinned(mesh: Mesh, infarct: Infarct) -> Mesh:
    """The unloaded wall, as thin in an infarct as is asked for; its epicardium moves towards the endocardium.

    Beside the infarct the thickness returns to that of the wall over the border zone, or over the wall's thickness if
    that is more.
    """
    thickness_scale = infarct.scar()["thickness_scale"]
    if thickness_scale == 1:
        return mesh
    depth = wall_depth(mesh)
    gradients = np.einsum("cqai,ca->cqi", material_gradients(mesh, NODE_XI)[0], depth[mesh.cells])
    gradient = np.stack([_at_nodes(mesh, part) for part in np.moveaxis(gradients, -1, 0)], axis=-1)
    steepness = np.linalg.norm(gradient, axis=1)  # one over the thickness
    border_mm = max(infarct.border_mm, 1e3 / float(np.median(steepness)))
    weight = _infarct_weight(mesh, depth, infarct.model_copy(update={"border_mm": border_mm}))
    of_node = _at_nodes(mesh, np.repeat(weight[:, None], 10, axis=1))
    outwards = ((thickness_scale - 1) * of_node * depth / steepness**2)[:, None] * gradient
    outwards[np.unique(mesh.base), 2] = 0.0
    return replace(mesh, nodes=mesh.nodes + outwards)


def _at_nodes(mesh: Mesh, values: Floats) -> Floats:
    """Mean (n_nodes,) over the cells around each node of values (n_cells, 10) at their nodes."""
    nodes = mesh.cells.ravel()
    return np.bincount(nodes, values.ravel()) / np.bincount(nodes)


def _by_segment(given: Mapping[int, float]) -> Floats:
    """Factors (18,) by the number of the AHA segment."""
    return np.array([given.get(number, 1.0) for number in range(18)])


def _gradual(values: Floats, segments: NDArray[np.uint8], centroid: Floats) -> Floats:
    """Values of cells in the segments (n_cells,), linear in the azimuth between the middles of a level's segments."""
    found = values[segments]
    azimuth = np.degrees(np.arctan2(centroid[:, 1], centroid[:, 0]))
    for level in (range(1, 7), range(7, 13), range(13, 17)):
        cells = np.isin(segments, level)
        middles = 90.0 - np.arange(len(level)) * 360 / len(level)
        found[cells] = np.interp(azimuth[cells], middles, values[level], period=360)
    return found


def _infarct_weight(mesh: Mesh, depth: Floats, infarct: Infarct) -> Floats:
    """Weight (n_cells,) of the infarct: 1 in it, falling linearly to 0 through the border zone (Lee 2011)."""
    if not infarct.is_there:
        return np.zeros(len(mesh.cells))
    values, border = shape(_SAMPLES), infarct.border_mm * mm
    positions = values @ mesh.nodes[mesh.cells]
    too_deep = np.clip(depth[mesh.cells] @ values.T, 0, 1) > infarct.transmurality
    infarcted = _in_region(mesh, depth, infarct, positions) & ~too_deep
    core = infarcted[:, _CENTROID]
    if not core.any():
        raise PathologyError(_no_cell(infarct))
    if border == 0:
        return core.astype(float)
    # Straight-line distance, even through the cavity, to the nearest of samples a quarter of an edge apart.
    from scipy.spatial import KDTree

    distance, _ = KDTree(positions[infarcted]).query(positions[:, _CENTROID], distance_upper_bound=border)
    return np.where(core, 1.0, np.clip(1 - distance / border, 0, 1))


def _in_region(mesh: Mesh, depth: Floats, infarct: Infarct, positions: Floats) -> NDArray[np.bool_]:
    """Whether positions (..., 3), m, are in the segments or the sphere of the infarct, at any depth."""
    if infarct.segments is not None:
        return np.isin(segment(positions, _apex(mesh)), infarct.segments)
    assert infarct.radius_mm is not None
    return np.linalg.norm(positions - infarct_centre(mesh, depth, infarct), axis=-1) <= infarct.radius_mm * mm


def infarct_centre(mesh: Mesh, depth: Floats, infarct: Infarct) -> Floats:
    """Centre of the sphere of an infarct, (3,), m: the middle of the wall in a direction from the long axis.

    Raises
    ------
    PathologyError
        If there is no wall in that direction.
    """
    centre = wall_point(mesh, depth, infarct.position, infarct.azimuth_deg * deg, 0.5)
    if centre is None:
        raise PathologyError(_no_cell(infarct))
    return centre


def wall_point(mesh: Mesh, depth: Floats, position: float, azimuth: float, at_depth: float) -> Floats | None:
    """Point of the wall in a direction from the long axis.

    Parameters
    ----------
    mesh : Mesh
    depth : ndarray of shape (n_nodes,)
        Wall depth.
    position : float
        Position along the long axis, 0 at the base, 1 at the endocardial apex.
    azimuth : float, rad
    at_depth : float
        Wall depth of the point.

    Returns
    -------
    ndarray of shape (3,), m, or None
        None if there is no wall in that direction.
    """
    radius = np.linspace(0, np.hypot(*mesh.nodes[:, :2].T).max(), 2001)
    height = np.full(len(radius), position * _apex(mesh))
    ray = np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height])
    points = locate(mesh.nodes, mesh.cells, ray)
    in_wall = points.cell >= 0
    if not in_wall.any():
        return None
    depths = interpolate(depth, mesh.cells, MaterialPoints(points.cell[in_wall], points.xi[in_wall]))
    return ray[in_wall][np.argmin(np.abs(depths - at_depth))]


def _apex(mesh: Mesh) -> float:
    """z of the endocardial apex, m."""
    return float(mesh.nodes[mesh.endo, 2].min())


def _no_cell(infarct: Infarct) -> str:
    """Why the infarct is refused, and the remedy."""
    if infarct.segments is not None:
        region, remedy = f"segments = {infarct.segments}", "name segments that the mesh has, or increase transmurality"
    else:
        where = f"at position {infarct.position} and azimuth_deg {infarct.azimuth_deg}"
        region = f"radius_mm = {infarct.radius_mm} {where}"
        remedy = "increase radius_mm, refine the mesh, or move the sphere into the wall"
    return f"pathology.infarct.{region}: no cell has its centroid in it: {remedy}."

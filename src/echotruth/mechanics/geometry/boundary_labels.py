"""Endocardium, epicardium and base on the boundary of a wall, as the file names them or found by their shape.

The cavity is the region from which most directions meet the wall. The endocardium is the part of the boundary that
faces it; the base is the part beyond its rim that faces the opening of the cavity; the rest is the epicardium. A right
endocardium is not found: a file that has one names all sides.
"""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from echotruth.config.geometry import BoundaryLabels
from echotruth.fem.tetrahedra import Floats, Integers
from echotruth.mechanics.geometry.boundary import (
    adjacent_triangles,
    area_vectors,
    component_labels,
    largest_component,
    unit_vector,
)
from echotruth.mechanics.geometry.cut import group_numbers, named_array
from echotruth.mechanics.geometry.imported_mesh import ImportedMesh
from echotruth.mechanics.geometry.mesh_quality import GeometryError
from echotruth.mechanics.geometry.rays import Rays, sphere_directions

logger = logging.getLogger("echotruth.mechanics")

ENDO, EPI, BASE, RIGHT_ENDO = range(4)
NAMES = ("endo", "epi", "base", "right_endo")

BASE_COSINE = np.cos(np.pi / 4)
"""Cosine of the largest angle between the normal of the base and the opening: half of a right-angled edge."""

MIN_ENCLOSURE = 0.55
"""Fraction of the directions that must meet the wall from a point in the cavity; beside a flat wall it is 0.5."""

SMOOTHING_LENGTH = 0.03
"""Distance over which normals are averaged, over the size of the wall: a wall cut along cells is rough."""

_REMEDY = "give a wall around a cavity that is open at the base, or name its sides with geometry.surface_labels"


@dataclass(frozen=True)
class BoundarySurface:
    """The closed boundary of a wall with the label of each facet, `ENDO`, `EPI`, `BASE` or `RIGHT_ENDO`.

    Attributes
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    facets : ndarray of shape (n_facets, 3 or 6)
        Normals point out of the wall.
    labels : ndarray of shape (n_facets,)
    """

    nodes: Floats
    facets: Integers
    labels: NDArray[np.int8]

    def rim(self, label: int = ENDO) -> Integers:
        """Edges between an endocardium and the base, shape (n, 2)."""
        pairs = adjacent_triangles(self.facets)
        at_rim = pairs[(np.sort(self.labels[pairs], axis=1) == sorted((label, BASE))).all(axis=1)]
        first, second = self.facets[at_rim[:, 0], :3], self.facets[at_rim[:, 1], :3]
        common = (first[:, :, None] == second[:, None]).any(axis=2)
        return first[common].reshape(-1, 2)

    def vertices(self, label: int) -> Floats:
        """Positions of the vertices of the facets with a label, shape (n, 3), m."""
        return self.nodes[np.unique(self.facets[self.labels == label][:, :3])]


def label_boundary(mesh: ImportedMesh, facets: Integers, given: BoundaryLabels | None) -> BoundarySurface:
    """Label the boundary of a wall.

    Parameters
    ----------
    mesh : ImportedMesh
    facets : ndarray of shape (n_facets, 3 or 6)
        Closed: every edge has two of them.
    given : BoundaryLabels or None
        Values of the labels in the file.

    Raises
    ------
    GeometryError
        Where there is no cavity, or no base round its opening.
    """
    labels = _labels_of_file(mesh, facets, given) if given else np.full(len(facets), -1, dtype=np.int8)
    if (labels < 0).any():
        all_named = all((labels == number).any() for number in (ENDO, EPI, BASE))
        # An array over points leaves the facets at the rims open.
        if all_named and given is not None and given.array in mesh.triangle_arrays:
            completed = _fill_from_neighbours(labels, adjacent_triangles(facets))
        else:
            completed = _detect_labels(mesh, facets)
        labels = np.where(labels < 0, completed, labels).astype(np.int8)
    surface = BoundarySurface(mesh.nodes, facets, labels)
    for number in (ENDO, EPI, BASE):
        if not (labels == number).any():
            raise GeometryError(f"{mesh.source}: no {NAMES[number]} was found on its boundary: {_REMEDY}")
    if not len(surface.rim()):
        raise GeometryError(f"{mesh.source}: endocardium and base do not meet: {_REMEDY}")
    if given is not None and given.right_endo and not len(surface.rim(RIGHT_ENDO)):
        remedy = "name an endocardium that is open at the base with geometry.surface_labels.right_endo"
        raise GeometryError(f"{mesh.source}: right endocardium and base do not meet: {remedy}")
    logger.info("%s: %s", mesh.source, ", ".join(f"{np.sum(labels == k)} facets {n}" for k, n in enumerate(NAMES)))
    return surface


def _labels_of_file(mesh: ImportedMesh, facets: Integers, given: BoundaryLabels) -> NDArray[np.int8]:
    """Labels of the facets that the file names, -1 elsewhere."""
    labels = np.full(len(facets), -1, dtype=np.int8)
    over_nodes = given.array in mesh.node_arrays and given.array not in mesh.triangle_arrays
    if not over_nodes:
        key = "geometry.surface_labels.array"
        named_array(mesh.triangle_arrays, given.array, mesh.source, key, "triangles or points")
    elif given.right_endo:
        # Points leave the facets at the rims without a label, and no detection knows two cavities.
        remedy = "name one over its triangles, as geometry.surface_labels.right_endo needs"
        raise GeometryError(f"{mesh.source}: geometry.surface_labels.array = {given.array!r} is over points: {remedy}")
    for number, name in enumerate(NAMES):
        configured: list[int | str] = getattr(given, name)
        values = group_numbers(configured, mesh, f"geometry.surface_labels.{name}")
        if over_nodes:
            matching = np.isin(mesh.node_arrays[given.array], values)[facets[:, :3]].all(axis=1)
        else:
            triangles = mesh.triangles[np.isin(mesh.triangle_arrays[given.array], values)]
            matching = _is_among(facets, triangles, len(mesh.nodes))
        if configured and not matching.any():
            raise GeometryError(
                f"{mesh.source}: geometry.surface_labels.{name} = {configured}: no facet of the wall has these values "
                f"in {given.array}: choose others of its values"
            )
        labels[matching] = number
    return labels


def _is_among(facets: Integers, triangles: Integers, n_nodes: int) -> NDArray[np.bool_]:
    """Which facets are among the triangles, whatever their order of vertices."""
    code = np.array([n_nodes**2, n_nodes, 1], dtype=np.int64)
    return np.isin(np.sort(facets[:, :3], axis=1) @ code, np.sort(triangles, axis=1) @ code)


def _fill_from_neighbours(labels: NDArray[np.int8], pairs: Integers) -> NDArray[np.int8]:
    """Give facets without a label that of a neighbour, from the labelled ones outwards."""
    labels = labels.copy()
    directed = np.vstack([pairs, pairs[:, ::-1]])
    while (labels < 0).any():
        front = directed[(labels[directed[:, 0]] >= 0) & (labels[directed[:, 1]] < 0)]
        if not len(front):
            break
        labels[front[:, 1]] = labels[front[:, 0]]
    return labels


def _detect_labels(mesh: ImportedMesh, facets: Integers) -> NDArray[np.int8]:
    """Labels of all facets, detected from the shape of the wall."""
    cavity_point, opening = _find_cavity(mesh, facets)
    pairs = adjacent_triangles(facets)
    area, centre = area_vectors(mesh.nodes, facets), mesh.nodes[facets[:, :3]].mean(axis=1)
    facing_cavity = np.einsum("fi,fi->f", area, centre - cavity_point) < 0
    outer = largest_component(~largest_component(facing_cavity, pairs), pairs)
    normal = _smoothed_area_vectors(area, centre, outer)
    base = _base_facets(outer, normal, opening, pairs)
    # Once more with the direction of the base itself, for which the opening of the cavity is a first guess.
    direction = unit_vector(area[base].sum(axis=0)) if base.any() else opening
    base = _base_facets(outer, normal, direction, pairs)
    epi = largest_component(outer & ~base, pairs)
    labels = np.where(outer, BASE, ENDO).astype(np.int8)
    labels[epi] = EPI
    return labels


def _smoothed_area_vectors(area: Floats, centre: Floats, outer: NDArray[np.bool_]) -> Floats:
    """Sum of the area vectors (n, 3) of each outer facet and the outer facets within `SMOOTHING_LENGTH`."""
    number = np.flatnonzero(outer)
    radius = SMOOTHING_LENGTH * np.ptp(centre, axis=0).max()
    pairs = number[cKDTree(centre[number]).query_pairs(radius, output_type="ndarray")]
    total = area.copy()
    for axis in range(3):
        for one, other in (pairs.T, pairs.T[::-1]):
            total[:, axis] += np.bincount(one, area[other, axis], len(area))
    return total


def _base_facets(outer: NDArray[np.bool_], normal: Floats, direction: Floats, pairs: Integers) -> NDArray[np.bool_]:
    """Outer facets whose normals lie about a direction and that are connected with the rim."""
    facing = outer & (normal @ direction > BASE_COSINE * np.linalg.norm(normal, axis=1))
    inside = pairs[outer[pairs].all(axis=1)]
    differing = inside[facing[inside[:, 0]] != facing[inside[:, 1]]]
    facing ^= np.bincount(differing.ravel(), minlength=len(outer)) >= 2
    at_rim = np.zeros(len(outer), dtype=bool)
    at_rim[pairs[outer[pairs[:, 0]] != outer[pairs[:, 1]]]] = True
    component = component_labels(len(outer), pairs[facing[pairs].all(axis=1)])
    return facing & np.isin(component, component[facing & at_rim])


def _find_cavity(mesh: ImportedMesh, facets: Integers) -> tuple[Floats, Floats]:
    """Point in the cavity (3,), m, and unit vector (3,) towards its opening."""
    surface, low, high = Rays(mesh.nodes, facets), mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    steps = np.linspace(0.1, 0.9, 7)
    points = low + (high - low) * np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    directions = sphere_directions(60)
    distances = [surface.intersections(np.broadcast_to(point, directions.shape), directions) for point in points]
    counts = np.array([[len(ray) for ray in rays] for rays in distances])
    # A ray from outside the wall meets its surface an even number of times.
    outside_wall = np.mean(counts % 2, axis=1) < 0.5
    enclosure = np.where(outside_wall, np.mean(counts > 0, axis=1), 0.0)
    if enclosure.max() < MIN_ENCLOSURE:
        raise GeometryError(f"{mesh.source}: no cavity was found, the wall looks solid or flat: {_REMEDY}")
    clearance = [np.mean([ray[0] for ray in rays if len(ray)] or [0.0]) for rays in distances]
    centre = points[np.argmax(np.where(enclosure > enclosure.max() - 0.1, clearance, 0.0))]
    directions = sphere_directions(1000)
    rays = surface.intersections(np.broadcast_to(centre, directions.shape), directions)
    free = directions[[not len(ray) for ray in rays]]
    if not len(free):
        raise GeometryError(f"{mesh.source}: the cavity is closed, there is no base: cut the wall open at the base")
    return centre, unit_vector(free.sum(axis=0))

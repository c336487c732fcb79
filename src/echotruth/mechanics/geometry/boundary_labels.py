"""Endocardium, epicardium and base of a wall: as the file names them, the others found by themselves.

The cavity is where most directions meet the wall. Seen from there the endocardium is what
shows its front; the base is what lies beyond its rim and looks where the cavity opens; the rest is
the epicardium.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from echotruth.config.geometry import Sides
from echotruth.fem.tetrahedra import Floats, Integers
from echotruth.mechanics.geometry.boundary import area_vectors, beside, largest, pieces
from echotruth.mechanics.geometry.cut import array_of, numbers
from echotruth.mechanics.geometry.imported_mesh import Body
from echotruth.mechanics.geometry.mesh_quality import GeometryError
from echotruth.mechanics.geometry.rays import Rays, all_round

logger = logging.getLogger("echotruth.mechanics")

ENDO, EPI, BASE = 0, 1, 2
NAMES = ("endo", "epi", "base")

OPEN = np.cos(np.pi / 4)
"""Cosine of the angle within which the base looks where the cavity opens: half of a right-angled edge."""

ENCLOSED = 0.55
"""Share of the directions that must meet the wall for a place to be a cavity; a flat wall takes 0.5."""

ROUGH = 0.03
"""Distance over which normals are averaged, over the size of the wall: a wall cut along cells is rough."""

_REMEDY = "give the wall round a cavity that is open at the base, or name its sides with geometry.sides"


@dataclass(frozen=True)
class Skin:
    """The closed boundary of a wall and its sides.

    Attributes
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    facets : ndarray of shape (n_facets, 3 or 6)
        Normals point out of the wall.
    side : ndarray of shape (n_facets,)
        `ENDO`, `EPI` or `BASE`.
    """

    nodes: Floats
    facets: Integers
    side: NDArray[np.int8]

    def rim(self) -> Integers:
        """Edges between endocardium and base, shape (n, 2)."""
        pairs = beside(self.facets)
        chosen = pairs[(self.side[pairs].min(axis=1) == ENDO) & (self.side[pairs].max(axis=1) == BASE)]
        first, second = self.facets[chosen[:, 0], :3], self.facets[chosen[:, 1], :3]
        common = (first[:, :, None] == second[:, None]).any(axis=2)
        return first[common].reshape(-1, 2)


def with_sides(body: Body, facets: Integers, sides: Sides | None) -> Skin:
    """The boundary of a wall with its sides.

    Parameters
    ----------
    body : Body
    facets : ndarray of shape (n_facets, 3 or 6)
        Closed: every edge has two of them.
    sides : Sides or None
        What the file names.

    Raises
    ------
    GeometryError
        Where there is no cavity, or no base round its opening.
    """
    side = _named(body, facets, sides) if sides else np.full(len(facets), -1, dtype=np.int8)
    if (side < 0).any():
        named = [(side == number).any() for number in range(len(NAMES))]
        # An array over points leaves the facets at the rims open.
        by_hand = all(named) and sides is not None and sides.array in body.triangle_arrays
        found = _spread(side, beside(facets)) if by_hand else _seen(body, facets)
        side = np.where(side < 0, found, side).astype(np.int8)
    skin = Skin(body.nodes, facets, side)
    for number, name in enumerate(NAMES):
        if not (side == number).any():
            raise GeometryError(f"{body.source}: no {name} was found at its boundary: {_REMEDY}")
    if not len(skin.rim()):
        raise GeometryError(f"{body.source}: endocardium and base do not meet: {_REMEDY}")
    logger.info("%s: %s", body.source, ", ".join(f"{np.sum(side == k)} facets {n}" for k, n in enumerate(NAMES)))
    return skin


def _named(body: Body, facets: Integers, sides: Sides) -> NDArray[np.int8]:
    """Side of the facets that the file names, -1 elsewhere."""
    side = np.full(len(facets), -1, dtype=np.int8)
    over_nodes = sides.array in body.node_arrays and sides.array not in body.triangle_arrays
    if not over_nodes:
        array_of(body.triangle_arrays, sides.array, body.source, "geometry.sides.array", "triangles or points")
    for number, name in enumerate(NAMES):
        asked: list[int | str] = getattr(sides, name)
        values = numbers(asked, body, f"geometry.sides.{name}")
        if over_nodes:
            here = np.isin(body.node_arrays[sides.array], values)[facets[:, :3]].all(axis=1)
        else:
            marked = body.triangles[np.isin(body.triangle_arrays[sides.array], values)]
            here = _among(facets, marked, len(body.nodes))
        if asked and not here.any():
            raise GeometryError(
                f"{body.source}: geometry.sides.{name} = {asked}: no facet of the wall has these values in "
                f"{sides.array}: choose others of its values"
            )
        side[here] = number
    return side


def _among(facets: Integers, triangles: Integers, n_nodes: int) -> NDArray[np.bool_]:
    """Which facets are among the triangles, whatever their order of vertices."""
    code = np.array([n_nodes**2, n_nodes, 1], dtype=np.int64)
    return np.isin(np.sort(facets[:, :3], axis=1) @ code, np.sort(triangles, axis=1) @ code)


def _spread(side: NDArray[np.int8], pairs: Integers) -> NDArray[np.int8]:
    """Facets without a name take that of a neighbour, from the named ones outwards."""
    side = side.copy()
    both = np.vstack([pairs, pairs[:, ::-1]])
    while (side < 0).any():
        at = both[(side[both[:, 0]] >= 0) & (side[both[:, 1]] < 0)]
        if not len(at):
            break
        side[at[:, 1]] = side[at[:, 0]]
    return side


def _seen(body: Body, facets: Integers) -> NDArray[np.int8]:
    """Sides of a wall of which nothing is named."""
    centre, opening = _cavity(body, facets)
    pairs = beside(facets)
    area = area_vectors(body.nodes, facets)
    inner = np.einsum("fi,fi->f", area, body.nodes[facets[:, :3]].mean(axis=1) - centre) < 0
    outer = largest(~largest(inner, pairs), pairs)
    normal = _smooth(area, body.nodes[facets[:, :3]].mean(axis=1), outer)
    base = _base(outer, normal, opening, pairs)
    # Once more with the direction of the base itself: where the cavity opens is that only roughly.
    direction = _unit(area[base].sum(axis=0)) if base.any() else opening
    base = _base(outer, normal, direction, pairs)
    epi = largest(outer & ~base, pairs)
    side = np.where(outer, BASE, ENDO).astype(np.int8)
    side[epi] = EPI
    return side


def _smooth(area: Floats, centre: Floats, outer: NDArray[np.bool_]) -> Floats:
    """Area vectors of facets (n, 3) added up over those close by, as far as they are outer ones."""
    number = np.flatnonzero(outer)
    near = cKDTree(centre[number]).query_pairs(ROUGH * np.ptp(centre, axis=0).max(), output_type="ndarray")
    pairs = number[near]
    total = area.copy()
    for axis in range(3):
        for one, other in (pairs.T, pairs.T[::-1]):
            total[:, axis] += np.bincount(one, area[other, axis], len(area))
    return total


def _base(outer: NDArray[np.bool_], normal: Floats, direction: Floats, pairs: Integers) -> NDArray[np.bool_]:
    """Facets beyond the rim that look in a direction and hang together with the rim."""
    facing = outer & (normal @ direction > OPEN * np.linalg.norm(normal, axis=1))
    inside = pairs[outer[pairs].all(axis=1)]
    apart = inside[facing[inside[:, 0]] != facing[inside[:, 1]]]
    facing ^= np.bincount(apart.ravel(), minlength=len(outer)) >= 2
    at_rim = np.zeros(len(outer), dtype=bool)
    rim = pairs[outer[pairs[:, 0]] != outer[pairs[:, 1]]]
    at_rim[rim] = True
    piece = pieces(len(outer), pairs[facing[pairs].all(axis=1)])
    return facing & np.isin(piece, piece[facing & at_rim])


def _cavity(body: Body, facets: Integers) -> tuple[Floats, Floats]:
    """A place in the cavity (m) and the direction in which the cavity opens."""
    rays, low, high = Rays(body.nodes, facets), body.nodes.min(axis=0), body.nodes.max(axis=0)
    steps = np.linspace(0.1, 0.9, 7)
    places = low + (high - low) * np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    few = all_round(60)
    met = [rays.meetings(np.broadcast_to(place, few.shape), few) for place in places]
    counts = np.array([[len(hits) for hits in each] for each in met])
    outside = np.mean(counts % 2, axis=1) < 0.5
    enclosed = np.where(outside, np.mean(counts > 0, axis=1), 0.0)
    if enclosed.max() < ENCLOSED:
        raise GeometryError(f"{body.source}: no cavity was found, it looks solid or flat: {_REMEDY}")
    room = [np.mean([hits[0] for hits in each if len(hits)] or [0.0]) for each in met]
    centre = places[np.argmax(np.where(enclosed > enclosed.max() - 0.1, room, 0.0))]
    many = all_round(1000)
    free = many[[not len(hits) for hits in rays.meetings(np.broadcast_to(centre, many.shape), many)]]
    if not len(free):
        raise GeometryError(f"{body.source}: the cavity is closed, there is no base: cut the wall open at the base")
    return centre, _unit(free.sum(axis=0))


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)

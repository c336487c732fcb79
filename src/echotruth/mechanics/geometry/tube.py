"""The tube: a wall of uniform thickness about the long axis, open at both ends."""

from __future__ import annotations

from typing import NamedTuple

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.geometry.ellipsoid import semi_axes
from echotruth.mechanics.geometry.lattice import lattice, tube_map


class Tube(NamedTuple):
    """Dimensions of a tube below its base at z = 0.

    Attributes
    ----------
    inner, outer : float, m
        Radii.
    length : float, m
    """

    inner: float
    outer: float
    length: float


def tube_dimensions(geometry: Geometry) -> Tube:
    """The tube as wide as the ellipsoids are at the equator and as long as the inner one is below the base."""
    (inner, length, base), (outer, _, _) = semi_axes(geometry)
    return Tube(inner, outer, length + base)


def tube(geometry: Geometry) -> Mesh:
    """Mesh of the tube, in boxes of six tetrahedra each; its lower end is neither endocardium, epicardium nor base."""
    counts = geometry.transmural_elements, geometry.circumferential_elements, geometry.longitudinal_elements
    return lattice(counts, tube_map(*tube_dimensions(geometry)), periodic=True)[0]

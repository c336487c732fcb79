"""The tube: a wall of one thickness about the long axis, open at both ends."""

from __future__ import annotations

from typing import NamedTuple

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.geometry.ellipsoid import shells
from echotruth.mechanics.geometry.lattice import lattice, tubular


class Tube(NamedTuple):
    """Lengths of a tube from the base at z = 0 downwards.

    Attributes
    ----------
    inner, outer : float, m
        Radii.
    length : float, m
    """

    inner: float
    outer: float
    length: float


def lengths(geometry: Geometry) -> Tube:
    """The tube as wide as the ellipsoids are at the equator and as long as the inner one is below the base."""
    (inner, length, base), (outer, _, _) = shells(geometry)
    return Tube(inner, outer, length + base)


def tube(geometry: Geometry) -> Mesh:
    """Mesh of the tube, in boxes of six tetrahedra each; the lower end is none of its named sides.

    Parameters
    ----------
    geometry : Geometry
    """
    counts = geometry.transmural_elements, geometry.circumferential_elements, geometry.longitudinal_elements
    return lattice(counts, tubular(*lengths(geometry)), around=True)[0]

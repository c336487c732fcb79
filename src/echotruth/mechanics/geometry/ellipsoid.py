"""The truncated thick ellipsoid, the idealised ventricle of Land et al., Proc R Soc A 471 (2015) 20150641."""

from functools import partial

import numpy as np

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.mesh_quality import check_cavity, check_inverted
from echotruth.mechanics.geometry.template import ellipse_angle, mesh_wall
from echotruth.units import mm


def ellipsoid(geometry: Geometry) -> Mesh:
    """Mesh of the ellipsoid of a preset, with the lengths and factors of the configuration.

    Parameters
    ----------
    geometry : Geometry

    Returns
    -------
    Mesh

    Raises
    ------
    GeometryError
        If a tetrahedron is inverted by the curvature of the wall.
    """
    endo, epi = semi_axes(geometry)
    mesh = mesh_wall(partial(_position, endo, epi), geometry)
    remedy = "raise longitudinal_elements or circumferential_elements, or make the apex less pointed"
    check_inverted(mesh, "geometry", remedy)
    check_cavity(mesh, "geometry", "set geometry.scale and the lengths, which are in millimetres, to those of a heart")
    return mesh


def semi_axes(geometry: Geometry) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Semi-axes of both ellipsoids across and along the long axis, and height of the base above their equator.

    Parameters
    ----------
    geometry : Geometry

    Returns
    -------
    endo, epi : tuple of float, m
        The cavity is dilated and elongated, the wall is added, and the result is scaled.
    """
    size = {key: value * mm * geometry.scale for key, value in geometry.lengths().items()}
    elongation = geometry.dilation * geometry.elongation
    radius, length = size["endo_radius_mm"] * geometry.dilation, size["endo_length_mm"] * elongation
    wall, apex_wall = (size[key] * geometry.hypertrophy for key in ("wall_mm", "apex_wall_mm"))
    base = size["base_mm"] * elongation
    return (radius, length, base), (radius + wall, length + apex_wall, base)


def _position(endo: tuple[float, ...], epi: tuple[float, ...], depth: Floats, r: Floats, azimuth: Floats) -> Floats:
    """Position (m) of points given by wall depth, distance from the apex and azimuth."""
    (endo_x, endo_z), (epi_x, epi_z) = _on_ellipsoid(r, *endo), _on_ellipsoid(r, *epi)
    x = (1 - depth) * endo_x + depth * epi_x
    z = (1 - depth) * endo_z + depth * epi_z
    return np.column_stack([x * np.cos(azimuth), x * np.sin(azimuth), z])


def _on_ellipsoid(r: Floats, radius: float, length: float, base: float) -> tuple[Floats, Floats]:
    """Distance from the axis and height (m) on an ellipsoid cut by the plane z = 0."""
    theta = ellipse_angle(r, radius, length, base)
    return radius * np.sin(theta), np.where(r == 1, 0.0, -base - length * np.cos(theta))

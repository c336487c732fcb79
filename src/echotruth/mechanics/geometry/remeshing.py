"""A wall of any shape filled with the elements of the template.

Lines start on the long axis and leave through the wall along the normals of a half-ellipsoid about as large as the
heart. Where a line meets the surface of the wall first is endocardium, last is epicardium. Both distances are
smoothed by Zernike's polynomials over the disc of (distance from the apex, azimuth) - the natural smooth functions
there, the apex included - so that the wall is as smooth as the elements can follow, and all hearts share one numbering.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import eval_jacobi

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.boundary_labels import BASE, ENDO, EPI, Skin
from echotruth.mechanics.geometry.frame import Frame, apex_of, axes_about, normal_of_base, rim_centroid
from echotruth.mechanics.geometry.mesh_quality import GeometryError
from echotruth.mechanics.geometry.rays import Rays
from echotruth.mechanics.geometry.template import course, laid_through

logger = logging.getLogger("echotruth.mechanics")

BELOW = 0.002
"""Depth of the cut below the lowest point of the base, over the length of the cavity."""

MISSES = 0.02
"""Share of the lines that may miss the wall, at flaws of the surface."""


@dataclass(frozen=True)
class Lines:
    """Lines through the wall, in the heart frame.

    Attributes
    ----------
    radius, length : float, m
        Semi-axes of the half-ellipsoid to which they are normal, across and along the long axis.
    deepest : float, m
        Depth below which no line starts: still inside the cavity.
    lean : ndarray of shape (2,)
        x and y of the apex over its z. The half-ellipsoid is sheared by it, so that its axis ends in the apex.
    """

    radius: float
    length: float
    deepest: float
    lean: Floats

    def at(self, r: Floats, azimuth: Floats) -> tuple[Floats, Floats]:
        """Start (n, 3), m, and direction (n, 3) of the lines at distances from the apex and azimuths, both (n,)."""
        angle = course(r, self.radius, self.length, 0.0)
        sine, cosine = np.sin(angle), np.where(r == 1, 0.0, np.cos(angle))
        depth = cosine * min(self.length - self.radius**2 / self.length, self.deepest)
        across, along = self.radius * sine, depth - self.length * cosine
        start = np.column_stack([np.zeros_like(r), np.zeros_like(r), -depth])
        direction = np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), along])
        for vectors in (start, direction):
            vectors[:, :2] += vectors[:, 2:] * self.lean
        return start, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def refilled(skin: Skin, septum: Floats | None, geometry: Geometry, source: str) -> tuple[Mesh, Frame]:
    """The template laid through a wall that is cut level below its base.

    Parameters
    ----------
    skin : Skin
    septum : ndarray of shape (3,) or None, m
        A place in the septum.
    geometry : Geometry
    source : str
        The file, for errors.

    Returns
    -------
    mesh : Mesh
    frame : Frame
        In which the mesh stands.

    Raises
    ------
    GeometryError
        Where lines from the long axis do not meet the wall.
    """
    surface = Rays(skin.nodes, skin.facets)
    frame = _level_frame(skin, surface, septum, geometry, source)
    local = Skin(frame.points(skin.nodes), skin.facets, skin.side)
    surface, lines = Rays(local.nodes, local.facets), _lines(local)
    r, azimuth = _disc(2 * geometry.longitudinal_elements, 3 * geometry.circumferential_elements)
    met = surface.meetings(*lines.at(r, azimuth))
    through = np.array([len(hits) > 1 for hits in met])
    if np.mean(~through) > MISSES:
        raise GeometryError(
            f"{source}: {np.sum(~through)} of {len(r)} lines from the long axis meet no wall: raise geometry.cut_mm to "
            "cut deeper below the base, or name the sides with geometry.sides"
        )
    distances = np.array([[hits[0], hits[-1]] for hits in met if len(hits) > 1])
    degree = min(geometry.longitudinal_elements, geometry.circumferential_elements // 2)
    weights = np.linalg.lstsq(_zernike(r[through], azimuth[through], degree), distances, rcond=None)[0]
    mesh = laid_through(partial(_wall, lines, weights, degree, geometry), geometry)
    if geometry.dilation == geometry.elongation == geometry.hypertrophy == 1:
        away = surface.distances(mesh.nodes[np.unique(np.vstack([mesh.endo, mesh.epi]))])
        logger.info(
            "%s: the new wall lies %.2g mm (root mean square) and at most %.2g mm off that of the file",
            *(source, 1e3 * np.sqrt(np.mean(away**2)), 1e3 * away.max()),
        )
    return mesh, frame


def _wall(
    lines: Lines, weights: Floats, degree: int, geometry: Geometry, depth: Floats, r: Floats, azimuth: Floats
) -> Floats:
    """Position (m) of points given by depth, distance from the apex and azimuth."""
    start, direction = lines.at(r, azimuth)
    endo, epi = (_zernike(r, azimuth, degree) @ weights).T
    along = geometry.dilation * geometry.elongation
    cavity = (start + endo[:, None] * direction) * [geometry.dilation, geometry.dilation, along]
    return cavity + (geometry.hypertrophy * depth * (epi - endo))[:, None] * direction


def _level_frame(skin: Skin, surface: Rays, septum: Floats | None, geometry: Geometry, source: str) -> Frame:
    """Frame with the origin in the middle of the cavity, in the plane of the cut, and z from the apex through it."""
    apex, rim, normal = apex_of(skin), rim_centroid(skin), normal_of_base(skin)
    base = skin.nodes[np.unique(skin.facets[skin.side == BASE][:, :3])]
    origin = rim
    for _ in range(4):
        axes = axes_about(origin - apex if normal is None else normal, septum, apex)
        z, length = axes[2], (rim - apex) @ axes[2]
        lowest = (base - apex) @ z
        below = lowest.min() - BELOW * length if geometry.cut_mm is None else length - 1e-3 * geometry.cut_mm
        if not 0.3 * length < below < length:
            raise GeometryError(
                f"{source}: the cut would leave {1e3 * below:.3g} mm of a cavity of {1e3 * length:.3g} mm: set "
                "geometry.cut_mm, its depth below the centre of the base, or name the base with geometry.sides"
            )
        along = origin - apex
        origin = _middle(surface, apex + along * below / (along @ z), axes, source)
    return Frame(origin, axes_about(origin - apex if normal is None else normal, septum, origin))


def _middle(surface: Rays, place: Floats, axes: Floats, source: str) -> Floats:
    """Centroid of the outline of the cavity in the plane across the long axis at a place (3,), m."""
    azimuth = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    directions = np.cos(azimuth)[:, None] * axes[0] + np.sin(azimuth)[:, None] * axes[1]
    for _ in range(3):
        met = surface.meetings(np.broadcast_to(place, directions.shape), directions)
        if min(map(len, met)) < 2:
            raise GeometryError(
                f"{source}: the wall is not closed all round where it would be cut: raise geometry.cut_mm to cut "
                "deeper below the base"
            )
        outline = place + np.array([hits[0] for hits in met])[:, None] * directions
        step = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1)
        place = step @ (outline + np.roll(outline, 1, axis=0)) / 2 / step.sum()
    return place


def _lines(skin: Skin) -> Lines:
    """Lines normal to a half-ellipsoid in the middle of the wall."""
    endo, epi = (skin.nodes[np.unique(skin.facets[skin.side == side][:, :3])] for side in (ENDO, EPI))
    depth = -endo[:, 2].min(), -epi[:, 2].min()
    upper = [points[(points[:, 2] < 0) & (points[:, 2] > -0.3 * depth[0])] for points in (endo, epi)]
    apex = apex_of(skin)
    lean = apex[:2] / apex[2]
    radius = np.mean([np.mean(np.linalg.norm(points[:, :2] - points[:, 2:] * lean, axis=1)) for points in upper])
    length = np.mean(depth)
    return Lines(min(radius, length), length, 0.9 * depth[0], lean)


def _disc(rings: int, around: int) -> tuple[Floats, Floats]:
    """Distances from the apex and azimuths at which the wall is looked for."""
    r, azimuth = np.meshgrid(np.arange(1, rings + 1) / rings, 2 * np.pi * np.arange(around) / around)
    return r.ravel(), azimuth.ravel()


def _zernike(r: Floats, azimuth: Floats, degree: int) -> Floats:
    """Zernike's polynomials up to a degree at points (n,) of the unit disc, shape (n, n_polynomials).

    Born & Wolf, Principles of Optics, section 9.2; the radial part is a Jacobi polynomial.
    """
    columns = []
    for n in range(degree + 1):
        for m in range(-n, n + 1, 2):
            radial = r ** abs(m) * eval_jacobi((n - abs(m)) // 2, 0, abs(m), 2 * r**2 - 1)
            columns.append(radial * (np.cos(m * azimuth) if m >= 0 else np.sin(-m * azimuth)))
    return np.column_stack(columns)

"""Remeshing of a wall of any shape with the elements of the template.

Lines start on the long axis and leave through the wall along the normals of a half-ellipsoid about as large as the
heart. The first intersection of a line with the surface of the wall is endocardium, the last is epicardium. Both
distances are smoothed by Zernike polynomials over the disc of (distance from the apex, azimuth), the natural smooth
functions there, the apex included. So the wall is as smooth as the elements can follow, and all hearts share one
numbering.
"""

import logging
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import eval_jacobi

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.boundary_labels import BASE, ENDO, EPI, BoundarySurface
from echotruth.mechanics.geometry.frame import HeartFrame, base_normal, endocardial_apex, heart_axes, rim_centroid
from echotruth.mechanics.geometry.mesh_quality import GeometryError
from echotruth.mechanics.geometry.rays import Rays
from echotruth.mechanics.geometry.template import ellipse_angle, mesh_wall

logger = logging.getLogger("echotruth.mechanics")

CUT_DEPTH = 0.002
"""Depth of the cut below the lowest point of the base, over the length of the cavity."""

MAX_MISSES = 0.02
"""Largest fraction of the lines that may miss the wall, at flaws of the surface."""


@dataclass(frozen=True)
class TransmuralLines:
    """Lines through the wall, in the heart frame.

    Attributes
    ----------
    radius, length : float, m
        Semi-axes of the half-ellipsoid to which they are normal, across and along the long axis.
    max_depth : float, m
        Depth below the base beneath which no line starts: still inside the cavity.
    shear : ndarray of shape (2,)
        x and y of the apex over its z. The half-ellipsoid is sheared by it, so that its axis ends in the apex.
    """

    radius: float
    length: float
    max_depth: float
    shear: Floats

    def rays(self, r: Floats, azimuth: Floats) -> tuple[Floats, Floats]:
        """Start (n, 3), m, and direction (n, 3) of the lines at distances from the apex and azimuths, both (n,)."""
        angle = ellipse_angle(r, self.radius, self.length, 0.0)
        sine, cosine = np.sin(angle), np.where(r == 1, 0.0, np.cos(angle))
        depth = cosine * min(self.length - self.radius**2 / self.length, self.max_depth)
        across, along = self.radius * sine, depth - self.length * cosine
        start = np.column_stack([np.zeros_like(r), np.zeros_like(r), -depth])
        direction = np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), along])
        for vectors in (start, direction):
            vectors[:, :2] += vectors[:, 2:] * self.shear
        return start, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def remesh(surface: BoundarySurface, septum: Floats | None, geometry: Geometry, source: str) -> tuple[Mesh, HeartFrame]:
    """Mesh a wall, cut level below its base, with the template.

    Parameters
    ----------
    surface : BoundarySurface
    septum : ndarray of shape (3,) or None, m
        A point in the septum.
    geometry : Geometry
    source : str
        The file, for errors.

    Returns
    -------
    mesh : Mesh
    frame : HeartFrame
        In which the mesh stands.

    Raises
    ------
    GeometryError
        Where lines from the long axis do not meet the wall.
    """
    frame = _frame_at_cut(surface, septum, geometry, source)
    local = BoundarySurface(frame.transform_points(surface.nodes), surface.facets, surface.labels)
    caster, lines = Rays(local.nodes, local.facets), _fit_lines(local)
    rings, around = 2 * geometry.longitudinal_elements, 3 * geometry.circumferential_elements
    grid = np.meshgrid(np.arange(1, rings + 1) / rings, 2 * np.pi * np.arange(around) / around)
    r, azimuth = (coordinate.ravel() for coordinate in grid)
    hits = caster.intersections(*lines.rays(r, azimuth))
    through = np.array([len(distances) > 1 for distances in hits])
    if np.mean(~through) > MAX_MISSES:
        raise GeometryError(
            f"{source}: {np.sum(~through)} of {len(r)} lines from the long axis meet no wall: raise geometry.cut_mm to "
            "cut deeper below the base, or name the sides with geometry.surface_labels"
        )
    endo_epi = np.array([[distances[0], distances[-1]] for distances in hits if len(distances) > 1])
    degree = min(geometry.longitudinal_elements, geometry.circumferential_elements // 2)
    coefficients = np.linalg.lstsq(_zernike(r[through], azimuth[through], degree), endo_epi, rcond=None)[0]
    mesh = mesh_wall(partial(_position, lines, coefficients, degree, geometry), geometry)
    if geometry.dilation == geometry.elongation == geometry.hypertrophy == 1:
        error = caster.distances(mesh.nodes[np.unique(np.vstack([mesh.endo, mesh.epi]))])
        logger.info(
            "%s: the new wall lies %.2g mm (root mean square) and at most %.2g mm off that of the file",
            *(source, 1e3 * np.sqrt(np.mean(error**2)), 1e3 * error.max()),
        )
    return mesh, frame


def _position(
    lines: TransmuralLines,
    coefficients: Floats,
    degree: int,
    geometry: Geometry,
    depth: Floats,
    r: Floats,
    azimuth: Floats,
) -> Floats:
    """Position (m) of points given by wall depth, distance from the apex and azimuth."""
    start, direction = lines.rays(r, azimuth)
    endo, epi = (_zernike(r, azimuth, degree) @ coefficients).T
    elongation = geometry.dilation * geometry.elongation
    cavity = (start + endo[:, None] * direction) * [geometry.dilation, geometry.dilation, elongation]
    return cavity + (geometry.hypertrophy * depth * (epi - endo))[:, None] * direction


def _frame_at_cut(surface: BoundarySurface, septum: Floats | None, geometry: Geometry, source: str) -> HeartFrame:
    """Frame with the origin in the middle of the cavity, in the plane of the cut, and z from the apex through it."""
    caster = Rays(surface.nodes, surface.facets)
    apex, rim, normal = endocardial_apex(surface), rim_centroid(surface), base_normal(surface)
    base = surface.vertices(BASE)
    origin = rim
    for _ in range(4):
        axes = heart_axes(origin - apex if normal is None else normal, septum, apex)
        z, length = axes[2], (rim - apex) @ axes[2]
        lowest = (base - apex) @ z
        height = lowest.min() - CUT_DEPTH * length if geometry.cut_mm is None else length - 1e-3 * geometry.cut_mm
        if not 0.3 * length < height < length:
            raise GeometryError(
                f"{source}: the cut would leave {1e3 * height:.3g} mm of a cavity of {1e3 * length:.3g} mm: set "
                "geometry.cut_mm, its depth below the centre of the base, or name the base with geometry.surface_labels"
            )
        along = origin - apex
        origin = _cavity_centroid(caster, apex + along * height / (along @ z), axes, source)
    return HeartFrame(origin, heart_axes(origin - apex if normal is None else normal, septum, origin))


def _cavity_centroid(caster: Rays, point: Floats, axes: Floats, source: str) -> Floats:
    """Centroid of the outline of the cavity in the plane across the long axis through a point (3,), m."""
    azimuth = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    directions = np.cos(azimuth)[:, None] * axes[0] + np.sin(azimuth)[:, None] * axes[1]
    for _ in range(3):
        hits = caster.intersections(np.broadcast_to(point, directions.shape), directions)
        if min(map(len, hits)) < 2:
            raise GeometryError(
                f"{source}: the wall is not closed all round where it would be cut: raise geometry.cut_mm to cut "
                "deeper below the base"
            )
        outline = point + np.array([distances[0] for distances in hits])[:, None] * directions
        step = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1)
        point = step @ (outline + np.roll(outline, 1, axis=0)) / 2 / step.sum()
    return point


def _fit_lines(surface: BoundarySurface) -> TransmuralLines:
    """Lines normal to a half-ellipsoid in the middle of the wall."""
    endo, epi = surface.vertices(ENDO), surface.vertices(EPI)
    depth = -endo[:, 2].min(), -epi[:, 2].min()
    basal = [points[(points[:, 2] < 0) & (points[:, 2] > -0.3 * depth[0])] for points in (endo, epi)]
    apex = endocardial_apex(surface)
    shear = apex[:2] / apex[2]
    radius = np.mean([np.mean(np.linalg.norm(points[:, :2] - points[:, 2:] * shear, axis=1)) for points in basal])
    length = np.mean(depth)
    return TransmuralLines(min(radius, length), length, 0.9 * depth[0], shear)


def _zernike(r: Floats, azimuth: Floats, degree: int) -> Floats:
    """Zernike polynomials up to a degree at points (n,) of the unit disc, shape (n, n_polynomials).

    Born & Wolf, Principles of Optics, section 9.2; the radial part is a Jacobi polynomial.
    """
    columns = []
    for n in range(degree + 1):
        for m in range(-n, n + 1, 2):
            radial = r ** abs(m) * eval_jacobi((n - abs(m)) // 2, 0, abs(m), 2 * r**2 - 1)
            columns.append(radial * (np.cos(m * azimuth) if m >= 0 else np.sin(-m * azimuth)))
    return np.column_stack(columns)

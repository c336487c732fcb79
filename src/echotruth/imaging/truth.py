"""The truth in the image: the motion of the tissue at every pixel, by the interpolation that carries the scatterers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.arrays import Floats
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, gradient, interpolate
from echotruth.heart import Heart
from echotruth.imaging.view import Plane
from echotruth.mechanics import kinematics
from echotruth.mechanics.fibres import axes_about, layer, unit

ORDER = {"short_axis": (0, 1, 2), "long_axis": (0, 2, 1)}
"""R, C, L in the order radial, tangential in an image, across it."""


def truth(heart: Heart, plane: Plane, axial: Floats, lateral: Floats) -> dict[str, NDArray[np.generic]]:
    """What the tissue at each pixel of each frame has done since end-diastole.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    axial, lateral : ndarray of shape (n_axial,), (n_lateral,), m
        Pixel centres.

    Returns
    -------
    dict of ndarray of shape (frame, n_axial, n_lateral, ...)
        displacement (3; lateral, axial, elevation; m), strain (6; RR, CC, LL, RC, RL, CL), mask, layer,
        segment, region, wall_depth. Outside the wall: NaN, False or 0.
    """
    pixels = plane.heart(np.stack(np.broadcast_arrays(lateral, axial[:, None], 0.0), axis=-1).reshape(-1, 3))
    frames, clip = len(heart.displacement), {}
    for frame in range(frames):
        inside, wall = _in_wall(heart, frame, pixels)
        for name, value in _motion(heart, frame, plane, wall).items():
            if name not in clip:
                clip[name] = _nothing((frames, len(pixels), *value.shape[1:]), value.dtype)
            clip[name][frame, inside] = value
    return {name: each.reshape(frames, len(axial), len(lateral), *each.shape[2:]) for name, each in clip.items()}


def _in_wall(heart: Heart, frame: int, places: Floats) -> tuple[NDArray[np.int64], MaterialPoints]:
    """Which of the places (n, 3), m, are in the wall in a frame, and what is there."""
    points = locate(heart.positions(frame), heart.cells, places)
    inside = np.flatnonzero(points.cell >= 0)
    return inside, MaterialPoints(points.cell[inside], points.xi[inside])


def _motion(heart: Heart, frame: int, plane: Plane, wall: MaterialPoints) -> dict[str, NDArray[np.generic]]:
    """Motion since end-diastole and labels of points of the wall."""
    return {
        "displacement": displacement(heart, frame, wall) @ plane.axes.T,
        "strain": strain(heart, frame, wall),
        "mask": np.ones(len(wall), bool),
        **labels(heart, wall),
    }


def follow(heart: Heart, plane: Plane, places: Floats, kind: str) -> dict[str, NDArray[np.generic]]:
    """The true motion of the tissue that is at given places of the image at end-diastole.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    places : ndarray of shape (n_axial, n_lateral, 2), m
        Lateral, axial.
    kind : {"short_axis", "long_axis"}
        Of the plane: tangential is circumferential or longitudinal in it.

    Returns
    -------
    dict of ndarray
        true_displacement (frame, n_axial, n_lateral, 2; lateral, axial; m) and through_plane
        (frame, n_axial, n_lateral; m) since end-diastole; wall_axes (n_axial, n_lateral, 2, 2), rows radial and
        tangential in the image at end-diastole; heart_strain and plane_strain (frame, n_axial, n_lateral, 3: radial,
        tangential, shear) since end-diastole, along the wall's axes in space and, of the part of F in the plane, along
        those in the image; layer and segment (n_axial, n_lateral) at end-diastole. Outside the wall: NaN or 0.
    """
    shape = places.shape[:2]
    flat = np.column_stack([places.reshape(-1, 2), np.zeros(shape[0] * shape[1])])
    inside, wall = _in_wall(heart, 0, plane.heart(flat))
    frames = range(len(heart.displacement))
    motion = np.stack([displacement(heart, frame, wall) @ plane.axes.T for frame in frames])
    deformation = np.stack([_deformation(heart, frame, wall) for frame in frames])
    seen = np.einsum("ai,...ij,bj->...ab", plane.axes[:2], deformation, plane.axes[:2])
    in_space, at_ed = _axes(heart, wall)[:, ORDER[kind]], labels(heart, wall)
    in_plane = wall_axes(in_space, plane)
    values = {
        "true_displacement": motion[..., :2],
        "through_plane": motion[..., 2],
        "heart_strain": kinematics.strain(deformation, in_space, kinematics.IMAGE),
        "plane_strain": kinematics.strain(seen, in_plane, kinematics.IMAGE),
    }
    images = {name: np.stack([_on_pixels(each, inside, shape) for each in value]) for name, value in values.items()}
    images["wall_axes"] = _on_pixels(in_plane, inside, shape)
    return images | {name: _on_pixels(at_ed[name], inside, shape) for name in ("layer", "segment")}


def wall_axes(in_space: Floats, plane: Plane) -> Floats:
    """The wall's own axes in the image.

    Parameters
    ----------
    in_space : ndarray of shape (n, 3, 3)
        Axes of the wall in the heart frame: radial, tangential, across; unit vectors.
    plane : Plane

    Returns
    -------
    ndarray of shape (n, 2, 2)
        Rows are radial, the part of R in the plane, and tangential, orthogonal to it on the side of C (short axis) or
        L (long axis); columns lateral, axial.
    """
    radial, tangent = (in_space[:, axis] @ plane.axes.T for axis in (0, 1))
    radial = unit(radial[:, :2])
    across = np.stack([-radial[:, 1], radial[:, 0]], axis=-1)
    side = np.where(np.sum(across * tangent[:, :2], axis=1) < 0, -1.0, 1.0)
    return np.stack([radial, across * side[:, None]], axis=1)


def displacement(heart: Heart, frame: int, points: MaterialPoints) -> Floats:
    """Displacement of material points since end-diastole, (n, 3) in the heart frame, m."""
    return interpolate(heart.displacement[frame] - heart.displacement[0], heart.cells, points)


def strain(heart: Heart, frame: int, points: MaterialPoints) -> Floats:
    """Green-Lagrange strain of material points since end-diastole along the wall's axes there, (n, 6)."""
    values = np.column_stack([heart.positions(frame), heart.wall_depth])
    slopes = gradient(values, heart.positions(0), heart.cells, points)
    return kinematics.strain(slopes[:, :3], axes_about(slopes[:, 3]), kinematics.RCL)


def _axes(heart: Heart, points: MaterialPoints) -> Floats:
    """R, C, L at end-diastole, (n, 3, 3)."""
    return axes_about(gradient(heart.wall_depth, heart.positions(0), heart.cells, points))


def _deformation(heart: Heart, frame: int, points: MaterialPoints) -> Floats:
    """F since end-diastole, (n, 3, 3)."""
    return gradient(heart.positions(frame), heart.positions(0), heart.cells, points)


def labels(heart: Heart, points: MaterialPoints) -> dict[str, NDArray[np.generic]]:
    """Wall depth (0 to 1), layer, AHA segment and region of disease of material points, each (n,)."""
    depth = np.clip(interpolate(heart.wall_depth, heart.cells, points), 0, 1)
    unloaded = interpolate(heart.nodes, heart.cells, points)
    return {
        "wall_depth": depth,
        "layer": layer(depth, heart.layers).astype(np.uint8),
        "segment": segment(unloaded, heart.apex),
        "region": np.zeros(len(points), np.uint8) if heart.region is None else heart.region[points.cell],
    }


def cavity_centre(heart: Heart, plane: Plane) -> Floats:
    """Centroid of the cavity in a short-axis plane at end-diastole: lateral, axial, m.

    The plane cuts the endocardial triangles in segments; the centroid is that of the polygon they enclose,
    summed from its middle by Green's theorem.
    """
    corners = plane.image(heart.positions(0)[_quarters(heart.endo)])
    pieces = np.array([cut for triangle in corners if (cut := _cut(triangle)) is not None])
    if not len(pieces):
        return np.full(2, np.nan)
    middle = pieces.mean(axis=(0, 1))
    a, b = (pieces - middle).transpose(1, 0, 2)
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return middle + (area[:, None] * (a + b) / 3).sum(axis=0) / area.sum()


def _quarters(facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """Each quadratic triangle as four straight ones, through the middles of its edges."""
    return facets[:, [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]].reshape(-1, 3)


def _cut(triangle: Floats) -> Floats | None:
    """Where the image plane (elevation 0) cuts a triangle: its two ends, or None."""
    ends = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        low, high = triangle[a], triangle[b]
        if (low[2] < 0) != (high[2] < 0):
            ends.append(low[:2] + (high[:2] - low[:2]) * low[2] / (low[2] - high[2]))
    return np.array(ends) if len(ends) == 2 else None


def _on_pixels(values: NDArray[np.generic], inside: NDArray[np.int64], shape: tuple[int, int]) -> NDArray[np.generic]:
    """An image of values at some of its pixels (flat numbers), with nothing at the others."""
    image = _nothing((shape[0] * shape[1], *values.shape[1:]), values.dtype)
    image[inside] = values
    return image.reshape(*shape, *values.shape[1:])


def _nothing(shape: tuple[int, ...], dtype: np.dtype) -> NDArray[np.generic]:
    """An array of NaN, in single precision, or of 0."""
    return np.full(shape, np.nan, np.float32) if dtype.kind == "f" else np.zeros(shape, dtype)

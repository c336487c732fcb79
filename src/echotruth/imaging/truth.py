"""The truth in the image: motion of the tissue at every pixel, interpolated as that of the scatterers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.aha import segment
from echotruth.arrays import Floats
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, gradient, interpolate, straight_triangles
from echotruth.heart import Heart
from echotruth.imaging.flow import flow
from echotruth.imaging.labels import TissueLabel, pack
from echotruth.imaging.view import Plane
from echotruth.mechanics import kinematics
from echotruth.mechanics.fibres import axes_from_normal, layer, unit

IMAGE_AXES = {"short_axis": (0, 1, 2), "long_axis": (0, 2, 1)}
"""Kind of plane to the indices of R, C, L in the order radial, tangential in the image, through-plane."""


TissueImage = Callable[[int], NDArray[np.uint8]]
"""A frame to the labels of the tissue at every pixel outside the wall, (n_axial, n_lateral)."""


def pixel_truth(
    heart: Heart, plane: Plane, axial: Floats, lateral: Floats, tissue: TissueImage | None = None
) -> dict[str, NDArray[np.generic]]:
    """All arrays of :class:`PixelTruth`, whose parameters these are."""
    return dict(PixelTruth(heart, plane, axial, lateral, tissue))


class PixelTruth(Mapping[str, NDArray[np.generic]]):
    """Motion and labels of the tissue at each pixel of each frame; an array is made when it is asked for.

    They are displacement (frame, n_axial, n_lateral, 3; lateral, axial, elevation; m) and strain (frame, n_axial,
    n_lateral, 6; RR, CC, LL, RC, RL, CL) since end-diastole, wall_depth (frame, n_axial, n_lateral), labels (frame, 3,
    n_axial, n_lateral; see :mod:`echotruth.imaging.labels`), and flow (frame, 2, n_axial, n_lateral, 3; m) to the
    previous and to the next frame (see :func:`echotruth.imaging.flow.flow`); in single precision. Outside the wall, and
    in flow to where there is no frame: NaN or 0. With `tissue` there is also the tissue (frame, n_axial, n_lateral), a
    :class:`echotruth.imaging.labels.TissueLabel`, outside the wall too.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    axial, lateral : ndarray of shape (n_axial,), (n_lateral,), m
        Pixel centres.
    tissue : callable, optional
        As :class:`echotruth.imaging.medium.tissue_images.TissueImages`.
    elevation : ndarray of shape (n_elevation,), m, optional
        Of the voxels of a volume; arrays then have n_axial, n_elevation, n_lateral in place of n_axial, n_lateral.
    frames : sequence of int, optional
        Those of which the arrays are. Default: all.
    """

    def __init__(
        self,
        heart: Heart,
        plane: Plane,
        axial: Floats,
        lateral: Floats,
        tissue: TissueImage | None = None,
        elevation: Floats | None = None,
        frames: Sequence[int] | None = None,
    ) -> None:
        self._tissue_image = tissue
        self._heart, self._frames = heart, range(len(heart.displacement)) if frames is None else frames
        pixels = _pixels(plane, axial, lateral, elevation)
        self._shape = pixels.shape[:-1]
        self._tissue = [_locate_in_wall(heart, frame, pixels.reshape(-1, 3)) for frame in self._frames]
        self._fields: dict[str, tuple[int, Callable[[int, MaterialPoints], NDArray[np.generic]]]] = {
            "displacement": (0, lambda frame, points: displacement(heart, frame, points) @ plane.axes.T),
            "strain": (0, lambda frame, points: strain(heart, frame, points)),
            "wall_depth": (0, lambda _, points: wall_depth(heart, points)),
            "labels": (1, lambda _, points: pack(labels(heart, points))),
            "flow": (1, lambda frame, points: flow(heart, frame, points) @ plane.axes.T),
        }
        """Number of dimensions of the values before that of the pixels, and the values at the tissue of a frame."""

    def __iter__(self) -> Iterator[str]:
        yield from self._fields
        if self._tissue_image is not None:
            yield "tissue"

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in list(iter(self))  # a mapping that is asked would make the array

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        if name == "tissue" and self._tissue_image is not None:
            return self._tissues(self._tissue_image)
        before, values_at = self._fields[name]
        images: NDArray[np.generic] = np.empty(0)
        for number, (frame, (inside, points)) in enumerate(zip(self._frames, self._tissue, strict=True)):
            values = values_at(frame, points)
            if not number:
                shape = (*values.shape[:before], prod(self._shape), *values.shape[before + 1 :])
                images = _empty((len(self._tissue), *shape), values.dtype)
            images[number][(slice(None),) * before + (inside,)] = values
        at = 1 + before
        return images.reshape(*images.shape[:at], *self._shape, *images.shape[at + 1 :])

    def _tissues(self, image: TissueImage) -> NDArray[np.uint8]:
        """Tissue at every pixel, (frame, n_axial, n_lateral), with the wall where the other arrays have it."""
        images = np.stack([image(frame) for frame in self._frames])
        for labels, (inside, _) in zip(images, self._tissue, strict=True):
            labels.reshape(-1)[inside] = TissueLabel.WALL
        return images


def wall_mask(
    heart: Heart, plane: Plane, axial: Floats, lateral: Floats, elevation: Floats | None = None
) -> NDArray[np.bool_]:
    """Whether points of the image are in the wall at end-diastole.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    axial, lateral : ndarray of shape (n_axial,), (n_lateral,), m
    elevation : ndarray of shape (n_elevation,), m, optional

    Returns
    -------
    ndarray of shape (n_axial, n_lateral), bool, or (n_axial, n_elevation, n_lateral)
    """
    pixels = _pixels(plane, axial, lateral, elevation)
    mask = np.zeros(prod(pixels.shape[:-1]), bool)
    mask[_locate_in_wall(heart, 0, pixels.reshape(-1, 3))[0]] = True
    return mask.reshape(pixels.shape[:-1])


def _pixels(plane: Plane, axial: Floats, lateral: Floats, elevation: Floats | None = None) -> Floats:
    """Pixel centres in the heart frame, (n_axial, n_lateral, 3), or (n_axial, n_elevation, n_lateral, 3), m."""
    if elevation is None:
        return plane.to_heart(np.stack(np.broadcast_arrays(lateral, axial[:, None], 0.0), axis=-1))
    voxels = np.broadcast_arrays(lateral, axial[:, None, None], elevation[:, None])
    return plane.to_heart(np.stack(voxels, axis=-1))


def _locate_in_wall(heart: Heart, frame: int, positions: Floats) -> tuple[NDArray[np.int64], MaterialPoints]:
    """Indices of the positions (n, 3), m, that are in the left wall in a frame, and the material points there."""
    points = locate(heart.positions(frame), heart.cells, positions)
    inside = np.flatnonzero((points.cell >= 0) & ~heart.right_wall[points.cell])
    return inside, MaterialPoints(points.cell[inside], points.xi[inside])


def material_truth(heart: Heart, plane: Plane, positions: Floats, kind: str) -> dict[str, NDArray[Any]]:
    """Motion of the tissue that is at given positions of the image at end-diastole.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    positions : ndarray of shape (n_axial, n_lateral, 2), m
        Lateral, axial.
    kind : {"short_axis", "long_axis"}
        Of the plane: tangential is circumferential or longitudinal in it.

    Returns
    -------
    dict of ndarray
        true_displacement (frame, n_axial, n_lateral, 2; lateral, axial; m) and through_plane
        (frame, n_axial, n_lateral; m) since end-diastole; wall_axes (n_axial, n_lateral, 2, 2), rows radial and
        tangential in the image at end-diastole; heart_strain and plane_strain (frame, n_axial, n_lateral, 3: radial,
        tangential, shear) since end-diastole, of F along the wall's axes in space and of the in-plane part of F along
        those in the image; layer and segment (n_axial, n_lateral) at end-diastole. Outside the wall: NaN or 0.
    """
    shape = positions.shape[:2]
    in_plane = np.column_stack([positions.reshape(-1, 2), np.zeros(shape[0] * shape[1])])
    inside, points = _locate_in_wall(heart, 0, plane.to_heart(in_plane))
    frames = range(len(heart.displacement))
    motion = np.stack([displacement(heart, frame, points) @ plane.axes.T for frame in frames])
    start = heart.positions(0)
    f = np.stack([gradient(heart.positions(frame), start, heart.cells, points) for frame in frames])
    f_in_plane = np.einsum("ai,...ij,bj->...ab", plane.axes[:2], f, plane.axes[:2])
    axes = axes_from_normal(gradient(heart.wall_depth, start, heart.cells, points))[:, IMAGE_AXES[kind]]
    axes_in_plane, at_ed = wall_axes(axes, plane), labels(heart, points)
    by_frame = {
        "true_displacement": motion[..., :2],
        "through_plane": motion[..., 2],
        "heart_strain": kinematics.strain(f, axes, kinematics.IMAGE_COMPONENTS),
        "plane_strain": kinematics.strain(f_in_plane, axes_in_plane, kinematics.IMAGE_COMPONENTS),
    }
    images = {name: np.stack([_to_image(one, inside, shape) for one in values]) for name, values in by_frame.items()}
    once = {"wall_axes": axes_in_plane, "layer": at_ed["layer"], "segment": at_ed["segment"]}
    return images | {name: _to_image(values, inside, shape) for name, values in once.items()}


def wall_axes(axes: Floats, plane: Plane) -> Floats:
    """Axes of the wall in the image.

    Parameters
    ----------
    axes : ndarray of shape (n, 3, 3)
        Axes of the wall in the heart frame: radial, tangential, through-plane; unit vectors.
    plane : Plane

    Returns
    -------
    ndarray of shape (n, 2, 2)
        Rows are radial, the part of R in the plane, and tangential, orthogonal to it on the side of C (short axis) or
        L (long axis); columns lateral, axial.
    """
    radial, tangent = (axes[:, axis] @ plane.axes.T for axis in (0, 1))
    radial = unit(radial[:, :2])
    normal = np.stack([-radial[:, 1], radial[:, 0]], axis=-1)
    sign = np.where(np.sum(normal * tangent[:, :2], axis=1) < 0, -1.0, 1.0)
    return np.stack([radial, normal * sign[:, None]], axis=1)


def displacement(heart: Heart, frame: int, points: MaterialPoints) -> Floats:
    """Displacement of material points since end-diastole, (n, 3) in the heart frame, m."""
    return interpolate(heart.displacement[frame] - heart.displacement[0], heart.cells, points)


def strain(heart: Heart, frame: int, points: MaterialPoints) -> Floats:
    """Green-Lagrange strain of material points since end-diastole along the axes of the wall there, (n, 6)."""
    values = np.column_stack([heart.positions(frame), heart.wall_depth])
    gradients = gradient(values, heart.positions(0), heart.cells, points)
    return kinematics.strain(gradients[:, :3], axes_from_normal(gradients[:, 3]), kinematics.RCL_COMPONENTS)


def wall_depth(heart: Heart, points: MaterialPoints) -> Floats:
    """Wall depth (0 to 1) of material points, (n,)."""
    depth: Floats = np.clip(interpolate(heart.wall_depth, heart.cells, points), 0, 1)
    return depth


def labels(heart: Heart, points: MaterialPoints) -> dict[str, NDArray[np.generic]]:
    """Layer, AHA segment and region of disease of material points, each (n,)."""
    unloaded = interpolate(heart.nodes, heart.cells, points)
    return {
        "layer": layer(wall_depth(heart, points), heart.layers).astype(np.uint8),
        "segment": segment(unloaded, heart.apex),
        "region": np.zeros(len(points), np.uint8) if heart.region is None else heart.region[points.cell],
    }


def cavity_centroid(heart: Heart, plane: Plane) -> Floats:
    """Centroid of the cavity in a short-axis plane at end-diastole: lateral, axial, m.

    The plane cuts the endocardial triangles in segments a b. With m the mean of their ends, the polygon that they
    enclose consists of triangles m a b: centroid = sum(area (m + a + b) / 3) / sum(area).
    """
    triangles = plane.to_image(heart.positions(0)[straight_triangles(heart.endo)])
    segments = np.array([cut for triangle in triangles if (cut := _intersection(triangle)) is not None])
    if not len(segments):
        return np.full(2, np.nan)
    mean = segments.mean(axis=(0, 1))
    a, b = (segments - mean).transpose(1, 0, 2)
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return mean + (area[:, None] * (a + b) / 3).sum(axis=0) / area.sum()


def _intersection(triangle: Floats) -> Floats | None:
    """Ends of the segment in which the image plane (elevation 0) cuts a triangle, or None."""
    ends = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        low, high = triangle[a], triangle[b]
        if (low[2] < 0) != (high[2] < 0):
            ends.append(low[:2] + (high[:2] - low[:2]) * low[2] / (low[2] - high[2]))
    return np.array(ends) if len(ends) == 2 else None


def _to_image(values: NDArray[np.generic], inside: NDArray[np.int64], shape: tuple[int, int]) -> NDArray[np.generic]:
    """Image of values at the pixels of indices `inside`, empty at the others."""
    image = _empty((shape[0] * shape[1], *values.shape[1:]), values.dtype)
    image[inside] = values
    return image.reshape(*shape, *values.shape[1:])


def _empty(shape: tuple[int, ...], dtype: np.dtype) -> NDArray[np.generic]:
    """An array of NaN, in single precision, or of 0."""
    return np.full(shape, np.nan, np.float32) if dtype.kind == "f" else np.zeros(shape, dtype)

"""Point tracks: points of the image followed through all frames as the tissue that is there moves."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import Integers, MaterialPoints, interpolate
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.flow import out_of_slice, slice_thickness
from echotruth.imaging.view import Plane
from echotruth.units import mm


def follow(positions: Floats, cells: Integers, plane: Plane, points: Floats, start: ArrayLike = 0) -> Floats:
    """Positions in all frames of the tissue that is at given points of the image in one frame, exact from the mesh.

    Parameters
    ----------
    positions : ndarray of shape (frame, n_nodes, 3), m
        Of the nodes, in the heart frame.
    cells : ndarray of shape (n_cells, 10)
    plane : Plane
    points : ndarray of shape (n, 2), m
        Lateral, axial.
    start : int or ndarray of shape (n,)
        Frame in which the tissue is there.

    Returns
    -------
    ndarray of shape (frame, n, 3), m
        Lateral, axial, elevation; NaN for points outside the wall.
    """
    at_start = plane.to_heart(np.column_stack([points, np.zeros(len(points))]))
    starts = np.broadcast_to(start, len(points))
    tissue = MaterialPoints(np.full(len(points), -1, np.int32), np.zeros((len(points), 3)))
    for frame in np.unique(starts):
        found = locate(positions[frame], cells, at_start[starts == frame])
        tissue.cell[starts == frame], tissue.xi[starts == frame] = found.cell, found.xi
    inside = tissue.cell >= 0
    tissue = MaterialPoints(tissue.cell[inside], tissue.xi[inside])
    followed = np.full((len(positions), len(points), 3), np.nan)
    for nodes, row in zip(positions, followed, strict=True):
        row[inside] = plane.to_image(interpolate(nodes, cells, tissue))
    return followed


def visible(config: Config, followed: Floats, thickness: float | Floats | None = None) -> NDArray[np.bool_]:
    """Whether an image shows the tissue at given positions: within its field of view, its scan and its slice.

    Parameters
    ----------
    config : Config
        How the heart is imaged.
    followed : ndarray of shape (..., 3), m
        Lateral, axial, elevation; NaN is not visible.
    thickness : float or ndarray of shape (...), m, optional
        Of the slice. Default: the two-way -6 dB width of the beam in elevation at that range
        (:func:`echotruth.imaging.flow.slice_thickness`).

    Returns
    -------
    ndarray of shape (...), bool
    """
    lateral, axial, elevation = np.moveaxis(followed, -1, 0)
    side = config.bmode.field_of_view_mm * mm
    shown = (np.abs(lateral) <= side / 2) & (axial >= 0) & (axial <= side)
    scan = scan_lines(config.probe, config.rf)
    line, range_ = scan.to_scan_coordinates(lateral, axial)
    shown &= (line >= 0) & (line <= len(scan.angle) - 1) & (range_ <= side)
    limit = slice_thickness(config, range_) if thickness is None else np.asarray(thickness)
    return shown & ~out_of_slice(elevation, limit)

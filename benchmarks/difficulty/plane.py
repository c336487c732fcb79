"""A perfect tracker of the plane: it follows the tissue that an image shows, and does not see what leaves the plane."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, interpolate
from echotruth.heart import Heart
from echotruth.imaging.tracks import follow
from echotruth.imaging.view import Plane
from echotruth.tracking.bidirectional import inverse_variance_weight, weighted_mean

_NOWHERE = 1e3
"""Coordinate, m, at which there is no tissue, for points that are lost."""


def plane_path(heart: Heart, plane: Plane, start: Floats, order: Sequence[int]) -> Floats:
    """Positions of points that go from frame to frame with whatever tissue is in the plane where they are.

    The motion from one frame to the next is exact from the mesh. It is that of the tissue which is in the plane in the
    frame from which it starts; in the next frame this tissue may be beside the plane, and the point goes on with other
    tissue.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    start : ndarray of shape (n, 2), m
        Lateral, axial, in the first frame of the order.
    order : sequence of int
        Frames, in the order in which they are visited.

    Returns
    -------
    ndarray of shape (len(order), n, 2), m
        In the order of the visits; NaN from the first visit on for which the point is not in the wall, and where it
        would have to leave from a place outside it.
    """
    path = np.full((len(order), *np.shape(start)), np.nan)
    path[0] = start
    for visit, (now, then) in enumerate(pairwise(order)):
        here = np.column_stack([np.nan_to_num(path[visit], nan=_NOWHERE), np.zeros(len(start))])
        found = locate(heart.positions(now), heart.cells, plane.to_heart(here))
        inside = found.cell >= 0
        tissue = MaterialPoints(found.cell[inside], found.xi[inside])
        path[visit + 1, inside] = plane.to_image(interpolate(heart.positions(then), heart.cells, tissue))[:, :2]
    return path


def tissue_path(heart: Heart, plane: Plane, start: Floats, order: Sequence[int]) -> Floats:
    """Positions in the image of the tissue itself, wherever it goes: of shape and meaning as in :func:`plane_path`.

    It is what an image shows of tissue that does not leave the plane (`phantom.in_plane_only`).
    """
    positions = np.stack([heart.positions(frame) for frame in order])
    return follow(positions, heart.cells, plane, start)[..., :2]


def both_ways(forward: Floats, backward: Floats, variances: Sequence[Floats]) -> Floats:
    """Mean of two ways around the cycle by their variances, and of one alone where a point is lost on the other.

    Parameters
    ----------
    forward, backward : ndarray of shape (..., n, 2), m
        NaN where a point is lost.
    variances : sequence of two ndarray
        Of the ways, of shapes that broadcast to (..., n), any unit.

    Returns
    -------
    ndarray of shape (..., n, 2), m
        NaN where a point is lost on both.
    """
    known = [np.asarray(np.isfinite(way).all(-1)) for way in (forward, backward)]
    weight = inverse_variance_weight(*(np.where(k, v, np.inf) for k, v in zip(known, variances, strict=True)))
    mean = weighted_mean(weight[..., None], forward, backward)
    return np.where((known[0] | known[1])[..., None], mean, np.nan)

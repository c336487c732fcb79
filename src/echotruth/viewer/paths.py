"""Paths of points of the tissue over the wall, true and tracked."""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.viewer.points import Points

ALONG_SIDE = 34
"""Paths along the side of an image that is all wall."""
MILLIMETRES = 1e3


def paths(points: Points, displacement: Floats) -> NDArray[np.float32]:
    """Where some of the points are in every frame.

    Parameters
    ----------
    points : Points
    displacement : ndarray of shape (frame, n, 2), m
        Of all points since end-diastole.

    Returns
    -------
    ndarray of shape (frame, some, 2)
        Lateral, axial, mm; NaN where it is not known.
    """
    step = max(1, round(points.clip.side / ALONG_SIDE / points.spacing))
    row, column = np.nonzero(points.inside)
    chosen = (row % step == step // 2) & (column % step == step // 2)
    position = points.position[chosen] + displacement[:, chosen]
    return (MILLIMETRES * position).astype(np.float32)

"""Twist of the ventricle: rotation of slices, of which :mod:`.physiology` takes the base from the apex.

The rotation of a clip, with the same sign, is in :mod:`echotruth.evaluation.courses`; that of a motion by a formula in
:mod:`.prescribed`.
"""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

BASAL_SLICE, APICAL_SLICE = 0.2, 0.8
"""Slices whose rotation makes the twist: distance from the base plane, over that of the endocardial apex."""
_HALF_SLICE = 0.1


def rotation(unloaded: Floats, endo: NDArray[np.integer], positions: Floats, centre: float) -> Floats:
    """Rotation of a short-axis slice since end-diastole.

    Parameters
    ----------
    unloaded : ndarray of shape (n_nodes, 3), m
    endo : ndarray of shape (n_facets, 6)
        Nodes of the endocardial triangles.
    positions : ndarray of shape (n_frames, n_nodes, 3), m
    centre : float
        Of the slice of material: `BASAL_SLICE` or `APICAL_SLICE`.

    Returns
    -------
    ndarray of shape (n_frames,), rad
        Positive counter-clockwise seen from the apex; between frames it may turn by less than half a turn.
    """
    height = unloaded[:, 2] / unloaded[endo, 2].min()
    nodes = np.abs(height - centre) <= _HALF_SLICE
    # The long axis points to the base: seen from the apex, rotation about it is clockwise.
    return -slice_rotation(positions[:, nodes, :2])


def slice_rotation(points: Floats) -> Floats:
    """Least-squares rotation of a slice about its centroid since the first frame.

    Parameters
    ----------
    points : ndarray of shape (n_frames, n_points, 2), m

    Returns
    -------
    ndarray of shape (n_frames,), rad
        Counter-clockwise, and continuous beyond half a turn.
    """
    arms = points - points.mean(axis=1, keepdims=True)
    first = arms[0]
    dot = np.sum(first * arms, axis=(1, 2))
    cross = np.sum(first[:, 0] * arms[..., 1] - first[:, 1] * arms[..., 0], axis=1)
    return np.unwrap(np.arctan2(cross, dot))

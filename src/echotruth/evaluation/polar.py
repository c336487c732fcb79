"""Polar components of in-plane vectors: radial and tangential to the ventricle."""

import numpy as np

UPRIGHT = (0.0, 1.0)
"""Direction of the long axis, from apex to base, in a long-axis image of a probe that is not turned."""


def directions(
    position: np.ndarray, origin: np.ndarray, plane: str, long_axis: tuple[float, ...] = UPRIGHT
) -> np.ndarray:
    """Radial and tangential unit vectors at every point.

    Short axis: e_r = (x, z) / r away from the origin and e_t = (z, -x) / r, counter-clockwise as seen in the image,
    whose axial axis z points down. Long axis: away from the line of the long axis, and along it, from apex to base.

    Parameters
    ----------
    position : ndarray of shape (point, 2)
        Lateral, axial, m.
    origin : ndarray of shape (2,)
        Centre of the cavity (short axis), or a point of the long axis: lateral, axial, m.
    plane : {"short_axis", "long_axis"}
    long_axis : tuple of two float
        Unit vector along the long axis, from apex to base: lateral, axial.

    Returns
    -------
    ndarray of shape (point, 2, 2)
        Component (radial, tangential) by axis (lateral, axial); NaN at the origin of a short-axis view.
    """
    offset = np.asarray(position, float) - np.asarray(origin, float)
    if plane == "short_axis":
        radius = np.hypot(offset[:, 0], offset[:, 1])
        lateral, axial = (offset / np.where(radius > 0, radius, np.nan)[:, None]).T
        return np.stack([np.stack([lateral, axial], -1), np.stack([axial, -lateral], -1)], -2)
    along = np.array(long_axis)
    across = np.array([along[1], -along[0]])
    sign = np.where(offset @ across >= 0, 1.0, -1.0)
    return np.stack([sign[:, None] * across, np.broadcast_to(along, offset.shape)], -2)


def resolve(
    vector: np.ndarray, position: np.ndarray, origin: np.ndarray, plane: str, long_axis: tuple[float, ...] = UPRIGHT
) -> np.ndarray:
    """Polar components of in-plane vectors.

    Parameters
    ----------
    vector : ndarray of shape (..., point, 2)
        Lateral, axial, any unit.
    position, origin, plane, long_axis
        As for :func:`directions`.

    Returns
    -------
    ndarray of shape (..., point, 2)
        Radial, tangential, in the unit of the vectors.
    """
    return np.einsum("...i,...ci->...c", vector, directions(position, origin, plane, long_axis))

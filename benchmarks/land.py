"""The ventricle of Land et al., Proc R Soc A 471 (2015) 20150641, problems 2 and 3.

Lengths in metres; the base is the plane z = 0 here and z = 5 mm there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BASE = 5e-3
ENDO, EPI = (7e-3, 17e-3), (10e-3, 20e-3)
"""Short and long semi-axes."""

ELEMENTS = (24, 18, 3)
"""Around, along and through the wall."""

PROBLEMS: dict[str, dict[str, Any]] = {
    "2": {"law": {"stiffness": 10e3, "fibre": 1.0, "transverse": 1.0, "shear": 1.0}, "pressure": 10e3, "tension": 0.0},
    "3": {"law": {"stiffness": 2e3, "fibre": 8.0, "transverse": 2.0, "shear": 4.0}, "pressure": 15e3, "tension": 60e3},
}
"""Constants (Pa) and loads."""

_BISECTIONS = 60


def fibre_frames(points: Floats) -> Floats:
    """Fibres from +90 degrees at the endocardium to -90 at the epicardium.

    Parameters
    ----------
    points : ndarray of shape (..., 3), m

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Rows f, s, n, right-handed.
    """
    x, y, z = np.moveaxis(points, -1, 0)
    across, height = np.hypot(x, y), z + BASE
    depth = _depth(across, height)
    short, long = (a + depth * (b - a) for a, b in zip(ENDO, EPI, strict=True))
    u, v = np.arctan2(across / short, height / long), np.arctan2(y, x)
    zero = np.zeros_like(u)
    along = _unit(short * np.cos(u) * np.cos(v), short * np.cos(u) * np.sin(v), -long * np.sin(u))
    around = _unit(-np.sin(v), np.cos(v), zero)
    angle = np.deg2rad(90 - 180 * depth)[..., None]
    fibre = np.sin(angle) * along + np.cos(angle) * around
    normal = np.cross(along, around)
    return np.stack([fibre, np.cross(normal, fibre), normal], axis=-2)


def _depth(across: Floats, height: Floats) -> Floats:
    """Depth 0 to 1 of the ellipsoid that holds a point, by bisection."""
    low, high = np.zeros_like(across), np.ones_like(across)
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        short, long = (a + middle * (b - a) for a, b in zip(ENDO, EPI, strict=True))
        outside = (across / short) ** 2 + (height / long) ** 2 > 1
        low, high = np.where(outside, middle, low), np.where(outside, high, middle)
    return (low + high) / 2


def _unit(*components: Floats) -> Floats:
    vector = np.stack(components, axis=-1)
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def apex(nodes: Floats, displacement: Floats) -> dict[str, float]:
    """z (mm, as in the paper) of the deformed apex, endocardial and epicardial."""
    on_axis = np.flatnonzero(np.hypot(nodes[:, 0], nodes[:, 1]) < 1e-9)
    order = on_axis[np.argsort(nodes[on_axis, 2])]
    height = (nodes + displacement)[order, 2] + BASE
    return {"endo": float(height[-1] * 1e3), "epi": float(height[0] * 1e3)}

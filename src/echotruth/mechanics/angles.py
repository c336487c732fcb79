"""Material axes of the wall from the angles of its fibres and sheets, and back."""

from __future__ import annotations

import numpy as np

from echotruth.fem.tetrahedra import Floats


def frames(axes: Floats, helix: Floats, transverse: Floats, sheet: Floats) -> Floats:
    """Material axes with given angles to the axes of the wall.

    Parameters
    ----------
    axes : ndarray of shape (..., 3, 3)
        Rows R, C and L.
    helix, transverse, sheet : ndarray of shape (...), rad
        As docs/conventions.md has them.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Rows f (fibre), s (sheet) and n = f x s (normal of the sheet), right-handed.
    """
    radial, circumferential, longitudinal = np.moveaxis(axes, -2, 0)
    fibre = np.cos(helix)[..., None] * circumferential + np.sin(helix)[..., None] * longitudinal
    material = np.stack([fibre, np.cross(radial, fibre), radial], axis=-2)
    # The transverse angle is seen along the long axis, so that a steep fibre leaves the wall by less.
    lift = np.arctan(np.cos(helix) * np.tan(transverse))
    for angle, first, second in ((lift, 0, 2), (-sheet, 1, 2)):
        # Off is off, without rounding.
        if np.any(angle):
            material = _swung(material, angle[..., None], first, second)
    return material


def read(frames: Floats, axes: Floats) -> tuple[Floats, Floats, Floats]:
    """Angles read back from material axes.

    Parameters
    ----------
    frames, axes : ndarray of shape (..., 3, 3)
        Rows f, s and n, and rows R, C and L.

    Returns
    -------
    helix, transverse, sheet : ndarray of shape (...), rad
        Between -pi/2 and pi/2: neither fibre nor sheet has a head. A fibre along L has no transverse angle.
    """
    fibre, sheet, _ = np.moveaxis(frames, -2, 0)
    outwards, around, along = np.moveaxis(np.einsum("...j,...ij->...i", fibre, axes), -1, 0)
    # The sheet turns about the fibre that points along C, wherever the head of the one given is.
    fibre = fibre * np.where(around < 0, -1.0, 1.0)[..., None]
    flat = np.cross(axes[..., 0, :], fibre)
    turn = _line(np.sum(sheet * flat, axis=-1), np.sum(sheet * np.cross(flat, fibre), axis=-1))
    return _line(around, along), _line(around, outwards), turn


def _line(along: Floats, aside: Floats) -> Floats:
    """Angle of a line, between -pi/2 and pi/2, rad, by its components."""
    return np.arctan2(aside * np.where(along < 0, -1.0, 1.0), np.abs(along))


def _swung(material: Floats, angle: Floats, first: int, second: int) -> Floats:
    """Frames with one axis swung towards another, and that away from it."""
    swung = material.copy()
    swung[..., first, :] = np.cos(angle) * material[..., first, :] + np.sin(angle) * material[..., second, :]
    swung[..., second, :] = np.cos(angle) * material[..., second, :] - np.sin(angle) * material[..., first, :]
    return swung

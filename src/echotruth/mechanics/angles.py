"""Conversion between the material axes of the wall and the angles of its fibres and sheets."""

import numpy as np

from echotruth.fem.tetrahedra import Floats


def frames_from_angles(axes: Floats, helix: Floats, transverse: Floats, sheet: Floats) -> Floats:
    """Material axes with given angles to the axes of the wall.

    Parameters
    ----------
    axes : ndarray of shape (..., 3, 3)
        Rows R, C and L.
    helix, transverse, sheet : ndarray of shape (...), rad
        As defined in docs/conventions.md.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Rows f (fibre), s (sheet) and n = f x s (normal of the sheet), right-handed.
    """
    radial, circumferential, longitudinal = np.moveaxis(axes, -2, 0)
    fibre = np.cos(helix)[..., None] * circumferential + np.sin(helix)[..., None] * longitudinal
    frames = np.stack([fibre, np.cross(radial, fibre), radial], axis=-2)
    # The transverse angle is seen along the long axis, so that a steep fibre leaves the wall by less.
    out_of_wall = np.arctan(np.cos(helix) * np.tan(transverse))
    for angle, first, second in ((out_of_wall, 0, 2), (-sheet, 1, 2)):
        # Zero angles are left out, so that they add no rounding.
        if np.any(angle):
            frames = _rotate_in_plane(frames, angle[..., None], first, second)
    return frames


def angles_from_frames(frames: Floats, axes: Floats) -> tuple[Floats, Floats, Floats]:
    """Angles of material axes.

    Parameters
    ----------
    frames, axes : ndarray of shape (..., 3, 3)
        Rows f, s and n, and rows R, C and L.

    Returns
    -------
    helix, transverse, sheet : ndarray of shape (...), rad
        Between -pi/2 and pi/2: fibres and sheets have no sign. A fibre along L has no transverse angle.
    """
    fibre, sheet, _ = np.moveaxis(frames, -2, 0)
    f_r, f_c, f_l = np.moveaxis(np.einsum("...j,...ij->...i", fibre, axes), -1, 0)
    # The sheet angle is about the fibre direction that points along C, whatever the sign of this one.
    fibre = fibre * np.where(f_c < 0, -1.0, 1.0)[..., None]
    in_wall = np.cross(axes[..., 0, :], fibre)
    sheet_angle = _line_angle(np.sum(sheet * in_wall, axis=-1), np.sum(sheet * np.cross(in_wall, fibre), axis=-1))
    return _line_angle(f_c, f_l), _line_angle(f_c, f_r), sheet_angle


def _line_angle(x: Floats, y: Floats) -> Floats:
    """Angle of a line without a sign, between -pi/2 and pi/2, rad, from its components."""
    return np.arctan2(y * np.where(x < 0, -1.0, 1.0), np.abs(x))


def _rotate_in_plane(frames: Floats, angle: Floats, first: int, second: int) -> Floats:
    """Frames with the first axis rotated towards the second, and that away from it."""
    rotated = frames.copy()
    rotated[..., first, :] = np.cos(angle) * frames[..., first, :] + np.sin(angle) * frames[..., second, :]
    rotated[..., second, :] = np.cos(angle) * frames[..., second, :] - np.sin(angle) * frames[..., first, :]
    return rotated

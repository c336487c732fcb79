"""Cross-correlation of windows that shrink from pass to pass, the second image deformed by the motion found so far.

After Scarano 2002 (Meas Sci Technol 13:R1): each pass carries the second image back by the field of the one before and
adds what its windows still find. A field is smoothed over the width of a window, without which motion finer than
the windows would grow from pass to pass (Astarita 2006, Exp Fluids 40:977).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from echotruth.config.tracking import WindowDeformation
from echotruth.imaging import spline
from echotruth.tracking.accumulation import accumulate
from echotruth.tracking.correlation import match, textured
from echotruth.tracking.field import Motion, motion, smooth, validated
from echotruth.tracking.grey import levels
from echotruth.tracking.windows import SMALLEST, Windows, arrange

STRIDE = 0.5
"""Step between windows over their side."""
REACH = 0.25
"""Largest shift over the side of a window (Keane and Adrian 1990, Meas Sci Technol 1:1202)."""


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: WindowDeformation,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame: see :func:`echotruth.tracking.tracker.track`.

    The quality is the correlation of the last windows, none below 0. Windows cover the image whatever the mask.

    Raises
    ------
    ValueError
        As :func:`arranged`.
    """
    passes = arranged(settings, frames.shape[1:], spacing)
    return accumulate(WindowPairs(passes), levels(frames), points, settings.reference)


def arranged(settings: WindowDeformation, shape: tuple[int, int], spacing: float) -> list[Windows]:
    """Windows of all passes.

    Parameters
    ----------
    settings : WindowDeformation
    shape : tuple of int
        Axial and lateral size of the image, px.
    spacing : float
        Distance of pixel centres, m.

    Returns
    -------
    list of Windows

    Raises
    ------
    ValueError
        If the image does not hold two windows side by side.
    """
    passes = [arrange(shape, side, STRIDE) for side in sides(settings, spacing)]
    for windows in passes:
        if min(len(windows.top), len(windows.left)) < 2:
            raise ValueError(f"An image of {shape[0]} x {shape[1]} px holds no two windows of {windows.side} px.")
    return passes


def sides(settings: WindowDeformation, spacing: float) -> list[int]:
    """Sides of the windows of all passes at one image size.

    Parameters
    ----------
    settings : WindowDeformation
    spacing : float
        Distance of pixel centres, m.

    Returns
    -------
    list of int
        px, even, 8 at least.
    """
    every = [max(SMALLEST, 2 * round(side / spacing / 2)) for side in settings.si().windows]
    return every + every[-1:] * (settings.sweeps - 1)


@dataclass(frozen=True)
class WindowPairs:
    """Window deformation of two images, as :class:`echotruth.tracking.accumulation.Pairs`.

    Attributes
    ----------
    passes : list of Windows
        Windows of all passes, from the first to the last.
    """

    passes: list[Windows]

    def prepare(self, image: np.ndarray) -> Prepared:
        """An image (axial, lateral), float32, with grey values from 0 to 1 or NaN, and what is worth knowing of it."""
        unknown = np.isnan(image)
        seen = {windows.side: textured(image, windows) for windows in self.passes}
        near = {windows.side: covered(windows, seen[windows.side], image.shape) for windows in self.passes[1:]}
        return Prepared(image, spline.coefficients(np.where(unknown, np.float32(0), image)), unknown, seen, near)

    def match(self, first: Prepared, second: Prepared, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points."""
        moved, peak = self.field(first, second)
        step, alike = moved.at(points), self.passes[-1].interpolate(peak[..., None], points)
        return np.where(np.isnan(alike), np.nan, step), np.maximum(alike[:, 0], 0)

    def field(self, first: Prepared, second: Prepared) -> tuple[Motion, np.ndarray]:
        """Motion everywhere.

        Returns
        -------
        moved : Motion
            That of the windows near by where there is no texture.
        peak : ndarray of shape (rows, columns)
            Correlation of the last windows; NaN where they have no texture.
        """
        moved = None
        for windows in self.passes:
            side = windows.side
            back = carry(second, moved, first.near[side]) if moved else second.image
            shift, peak = match(first.image, back, windows, first.seen[side], round(REACH * side))
            shift += moved.mean(windows) if moved else 0.0
            moved = motion(smooth(validated(shift)), windows, first.image.shape)
        return moved, peak


@dataclass(frozen=True)
class Prepared:
    """An image and what is worth working out once.

    Attributes
    ----------
    image : ndarray of shape (axial, lateral), float32
        Grey values from 0 to 1; NaN where there are none.
    coefficients : ndarray
        Of its spline, see :func:`echotruth.imaging.spline.coefficients`.
    unknown : ndarray of shape (axial, lateral), bool
        Pixels without a value.
    seen : dict of ndarray of shape (rows, columns), bool
        By the side of windows, which of them have texture.
    near : dict of ndarray of shape (axial, lateral), bool
        By the side of windows, the pixels with which those are compared.
    """

    image: np.ndarray
    coefficients: np.ndarray
    unknown: np.ndarray
    seen: dict[int, np.ndarray]
    near: dict[int, np.ndarray]


def covered(windows: Windows, seen: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Pixels (axial, lateral), bool, under the windows that are seen (rows, columns) at any lag."""
    result, reach = np.zeros(shape, bool), round(REACH * windows.side)
    for row, column in np.argwhere(seen):
        top, left = windows.top[row] - reach, windows.left[column] - reach
        result[max(0, top) : top + windows.side + 2 * reach, max(0, left) : left + windows.side + 2 * reach] = True
    return result


def carry(image: Prepared, moved: Motion, near: np.ndarray) -> np.ndarray:
    """An image carried back by the motion to it.

    Parameters
    ----------
    image : Prepared
    moved : Motion
    near : ndarray of shape (axial, lateral), bool
        Pixels that are wanted.

    Returns
    -------
    ndarray of shape (axial, lateral), float32
        At every pixel what is at the end of its motion, or at the border nearest to it; NaN where there is nothing, or
        it is not wanted.
    """
    columns, rows = moved.pixels
    result = np.full(near.shape, np.nan, np.float32)
    _carry(image.coefficients, image.unknown, moved.coefficients, columns, rows, near, result)
    return result


@numba.njit(cache=True, nogil=True)
def _carry(image, unknown, moved, columns, rows, near, result):
    height, width = near.shape
    (column, across), line = columns, np.empty(moved.shape[1:])
    for y in range(height):
        _along(moved, rows[0][y], rows[1][y], line)
        for x in range(width):
            if near[y, x]:
                lateral, axial = np.float64(x), np.float64(y)
                for b in range(4):
                    lateral += across[x, b] * line[column[x] + b, 0]
                    axial += across[x, b] * line[column[x] + b, 1]
                lateral, axial = min(max(lateral, 0.0), width - 1.0), min(max(axial, 0.0), height - 1.0)
                if not unknown[int(axial + 0.5), int(lateral + 0.5)]:
                    result[y, x] = spline.value(image, np.float32(axial), np.float32(lateral))


@numba.njit(cache=True, nogil=True)
def _along(moved, first, shares, line):
    """Write the coefficients (columns, 2) of the motion along a row of pixels, by the shares of four rows of them."""
    for j in range(len(line)):
        for k in range(2):
            line[j, k] = 0.0
            for a in range(4):
                line[j, k] += shares[a] * moved[first + a, j, k]

"""Cross-correlation of windows that shrink from pass to pass, the second image deformed by the motion found so far.

After Scarano 2002 (Meas Sci Technol 13:R1): each pass carries the second image back by the field of the one before and
adds what its windows still find. A field is smoothed over the width of a window, without which motion finer than
the windows would grow from pass to pass (Astarita 2006, Exp Fluids 40:977).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.config.tracking import WindowDeformation
from echotruth.tracking.accumulation import accumulate
from echotruth.tracking.correlation import match
from echotruth.tracking.field import dense, resample, smooth, validated
from echotruth.tracking.flow import sample
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

    def prepare(self, image: np.ndarray) -> np.ndarray:
        """The image as it is, grey values from 0 to 1."""
        return image

    def match(self, first: np.ndarray, second: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points."""
        moved, peak = self.field(first, second)
        step, alike = sample(moved, points), self.passes[-1].interpolate(peak[..., None], points)
        return np.where(np.isnan(alike), np.nan, step), np.maximum(alike[:, 0], 0)

    def field(self, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Motion of all pixels.

        Parameters
        ----------
        first, second : ndarray of shape (axial, lateral)
            Grey values from 0 to 1; NaN where there are none.

        Returns
        -------
        moved : ndarray of shape (axial, lateral, 2)
            Lateral, axial, px; that of the windows near by where there is no texture.
        peak : ndarray of shape (rows, columns)
            Correlation of the last windows; NaN where they have no texture.
        """
        moved = np.zeros((*first.shape, 2), np.float32)
        for windows in self.passes:
            shift, peak = match(first, carry(second, moved), windows, round(REACH * windows.side))
            moved = dense(smooth(validated(windows.mean(moved) + shift)), windows, first.shape)
        return moved, peak


def carry(image: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """An image carried back by the motion to it.

    Parameters
    ----------
    image : ndarray of shape (axial, lateral)
        Grey values; NaN where there are none.
    moved : ndarray of shape (axial, lateral, 2)
        Lateral, axial, px.

    Returns
    -------
    ndarray of shape (axial, lateral), float32
        At every pixel what is at the end of its motion, or at the border nearest to it.
    """
    row, column = (
        np.clip(index + moved[..., 1 - axis], 0, image.shape[axis] - 1)
        for axis, index in enumerate(np.indices(image.shape, np.float32))
    )
    unknown = np.isnan(image)
    result = resample(np.where(unknown, 0, image), row, column)
    result[unknown[row.round().astype(int), column.round().astype(int)]] = np.nan
    return result

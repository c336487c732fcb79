"""Cross-correlation of windows that shrink from pass to pass, with the second image deformed by the current estimate.

After Scarano 2002 (Meas Sci Technol 13:R1): each pass warps the second image back by the field of the previous pass and
adds the shifts of its windows. The field is smoothed over the width of a window; otherwise motion finer than the
windows would grow from pass to pass (Astarita 2006, Exp Fluids 40:977).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from echotruth.config.tracking import WindowDeformation
from echotruth.imaging import spline
from echotruth.tracking.accumulation import Path, follow
from echotruth.tracking.correlation import has_texture, match_windows
from echotruth.tracking.field import DisplacementField, displacement_field, replace_outliers, smooth
from echotruth.tracking.grey import amplitudes
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.windows import MIN_WINDOW_SIDE, Windows, arrange
from echotruth.units import mm

STRIDE = 0.5
"""Step between windows over their side."""
MAX_SHIFT = 0.25
"""Largest shift over the side of a window (Keane and Adrian 1990, Meas Sci Technol 1:1202)."""


def track(clip: TrackerInput, settings: WindowDeformation) -> Path:
    """Path of the points of a clip, with the correlation of the last windows.

    Windows cover the whole image; the mask is not used. ValueError as :func:`window_passes` raises it.
    """
    tracker = WindowDeformationTracker(window_passes(settings, clip.shape, clip.spacing))
    return follow(tracker, amplitudes(clip.frames, settings.dynamic_range_dB), clip.points, settings.reference)


def window_passes(settings: WindowDeformation, shape: tuple[int, int], spacing: float) -> list[Windows]:
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
        If two windows do not fit side by side into the image.
    """
    passes = [arrange(shape, side, STRIDE) for side in window_sides(settings, spacing)]
    for windows in passes:
        if min(len(windows.top), len(windows.left)) < 2:
            size = f"{shape[0]} x {shape[1]}"
            raise ValueError(f"An image of {size} px has no room for two windows of {windows.side} px.")
    return passes


def window_sides(settings: WindowDeformation, spacing: float) -> list[int]:
    """Side of the windows in each pass.

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
    sides = [max(MIN_WINDOW_SIDE, 2 * round(side * mm / spacing / 2)) for side in settings.windows_mm]
    return sides + sides[-1:] * (settings.final_passes - 1)


@dataclass(frozen=True)
class WindowDeformationTracker:
    """Window deformation of two images, as :class:`echotruth.tracking.accumulation.PairTracker`.

    Attributes
    ----------
    passes : list of Windows
        Windows of all passes, from the first to the last.
    """

    passes: list[Windows]

    def prepare(self, image: np.ndarray) -> PreparedImage:
        """Spline and texture of an image (axial, lateral), float32, with grey values from 0 to 1 or NaN."""
        unknown = np.isnan(image)
        textured = {windows.side: has_texture(image, windows) for windows in self.passes}
        search = {w.side: search_pixels(w, textured[w.side], image.shape) for w in self.passes[1:]}
        coefficients = spline.coefficients(np.where(unknown, np.float32(0), image))
        return PreparedImage(image, coefficients, unknown, textured, search)

    def match(self, first: PreparedImage, second: PreparedImage, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points."""
        field, peak = self.field(first, second)
        step, ncc = field.at(points), self.passes[-1].interpolate(peak[..., None], points)
        return np.where(np.isnan(ncc), np.nan, step), np.maximum(ncc[:, 0], 0)

    def field(self, first: PreparedImage, second: PreparedImage) -> tuple[DisplacementField, np.ndarray]:
        """Displacement of the whole image.

        Returns
        -------
        field : DisplacementField
            Where there is no texture, that of the windows near by.
        peak : ndarray of shape (rows, columns)
            Correlation of the last windows; NaN where they have no texture.
        """
        field = None
        for windows in self.passes:
            side = windows.side
            warped = warp(second, field, first.search[side]) if field else second.image
            shift, peak = match_windows(first.image, warped, windows, first.textured[side], round(MAX_SHIFT * side))
            shift += field.mean(windows) if field else 0.0
            field = displacement_field(smooth(replace_outliers(shift)), windows, first.image.shape)
        assert field is not None
        return field, peak


@dataclass(frozen=True)
class PreparedImage:
    """An image and what every comparison needs of it.

    Attributes
    ----------
    image : ndarray of shape (axial, lateral), float32
        Grey values from 0 to 1; NaN where unknown.
    coefficients : ndarray
        Of its spline, see :func:`echotruth.imaging.spline.coefficients`.
    unknown : ndarray of shape (axial, lateral), bool
        Pixels without a value.
    textured : dict of ndarray of shape (rows, columns), bool
        Side of the windows -> windows that have texture.
    search : dict of ndarray of shape (axial, lateral), bool
        Side of the windows -> pixels within the largest shift of these.
    """

    image: np.ndarray
    coefficients: np.ndarray
    unknown: np.ndarray
    textured: dict[int, np.ndarray]
    search: dict[int, np.ndarray]


def search_pixels(windows: Windows, textured: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Pixels (axial, lateral), bool, that the textured windows (rows, columns) cover at any lag."""
    pixels, lag = np.zeros(shape, bool), round(MAX_SHIFT * windows.side)
    for row, column in np.argwhere(textured):
        top, left = windows.top[row] - lag, windows.left[column] - lag
        pixels[max(0, top) : top + windows.side + 2 * lag, max(0, left) : left + windows.side + 2 * lag] = True
    return pixels


def warp(image: PreparedImage, field: DisplacementField, pixels: np.ndarray) -> np.ndarray:
    """Warp an image back by the displacement to it, I(x + u(x)).

    Parameters
    ----------
    image : PreparedImage
    field : DisplacementField
    pixels : ndarray of shape (axial, lateral), bool
        Pixels at which the result is wanted.

    Returns
    -------
    ndarray of shape (axial, lateral), float32
        Outside the image its border is taken; NaN where unknown or not wanted.
    """
    columns, rows = field.pixel_weights
    result = np.full(pixels.shape, np.nan, np.float32)
    _warp(image.coefficients, image.unknown, field.coefficients, columns, rows, pixels, result)
    return result


@numba.njit(cache=True, nogil=True)
def _warp(image, unknown, field, columns, rows, pixels, result):
    height, width = pixels.shape
    (column, weight_x), line = columns, np.empty(field.shape[1:])
    for y in range(height):
        _interpolate_row(field, rows[0][y], rows[1][y], line)
        for x in range(width):
            if pixels[y, x]:
                lateral, axial = np.float64(x), np.float64(y)
                for b in range(4):
                    lateral += weight_x[x, b] * line[column[x] + b, 0]
                    axial += weight_x[x, b] * line[column[x] + b, 1]
                lateral, axial = min(max(lateral, 0.0), width - 1.0), min(max(axial, 0.0), height - 1.0)
                if not unknown[int(axial + 0.5), int(lateral + 0.5)]:
                    result[y, x] = spline.value(image, np.float32(axial), np.float32(lateral))


@numba.njit(cache=True, nogil=True)
def _interpolate_row(field, first, weights, line):
    """Write the coefficients (columns, 2) of a field along a row of pixels, from four rows of its coefficients."""
    for j in range(len(line)):
        for k in range(2):
            line[j, k] = 0.0
            for a in range(4):
                line[j, k] += weights[a] * field[first + a, j, k]

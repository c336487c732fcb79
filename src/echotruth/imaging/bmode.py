"""B-mode: from lines to 8-bit images on the square field of view.

The envelope is interpolated before it is compressed, so the speckle keeps its statistics, and one reference serves
the whole clip, so that brightness means the same in every frame.
"""

from __future__ import annotations

import numpy as np

from echotruth.config import Bmode


def envelope(lines: np.ndarray) -> np.ndarray:
    """Envelope of demodulated or analytic lines (any shape, complex64): same shape, float32."""
    return np.abs(lines)


def pixel_centres(bmode: Bmode, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Axial and lateral coordinates of the pixel centres of a square image, each of shape (size,), m.

    The array stands in the middle of the upper edge: axial runs from 0 to the side, lateral from minus to plus half.
    """
    side = bmode.si().field_of_view
    axial = (np.arange(size) + 0.5) * side / size
    return axial, axial - side / 2


class ScanConversion:
    """Interpolation from lines to pixels by cubic splines in angle and range, worked out once for a clip.

    Parameters
    ----------
    angle
        Of the lines, shape (lines,), rad, evenly spaced.
    range_
        Of the samples, shape (ranges,), m, evenly spaced.
    bmode
        Field of view and size of the image.
    """

    def __init__(self, angle: np.ndarray, range_: np.ndarray, bmode: Bmode):
        self._shape = (bmode.size_px, bmode.size_px)
        axial, lateral = np.meshgrid(*pixel_centres(bmode, bmode.size_px), indexing="ij")
        line = (np.arctan2(lateral, axial) - angle[0]) / (angle[1] - angle[0])
        sample = (np.hypot(lateral, axial) - range_[0]) / (range_[1] - range_[0])
        self._inside = (line >= 0) & (line <= len(angle) - 1) & (sample >= 0) & (sample <= len(range_) - 1)
        self._coordinates = np.stack([line[self._inside], sample[self._inside]])

    def __call__(self, polar: np.ndarray) -> np.ndarray:
        """Image (axial, lateral) of one frame (lines, ranges), float32; 0 outside of the sector, never negative."""
        from scipy.ndimage import map_coordinates

        image = np.zeros(self._shape, np.float32)
        # The spline may swing below zero beside an edge; an envelope does not.
        image[self._inside] = np.maximum(map_coordinates(polar, self._coordinates, order=3, mode="mirror"), 0)
        return image


def scan_convert(polar: np.ndarray, angle: np.ndarray, range_: np.ndarray, bmode: Bmode) -> np.ndarray:
    """Envelope on the pixels of the field of view.

    Parameters
    ----------
    polar
        Envelope, shape (frames, lines, ranges).
    angle, range_
        Of lines (rad) and samples (m), evenly spaced.
    bmode
        Field of view and size of the image.

    Returns
    -------
    Shape (frames, axial, lateral), float32; 0 outside of the sector.
    """
    convert = ScanConversion(angle, range_, bmode)
    return np.stack([convert(frame) for frame in polar])


def log_compress(images: np.ndarray, dynamic_range_dB: float) -> np.ndarray:
    """Eight-bit images of a clip of envelopes.

    Parameters
    ----------
    images
        Any shape, not negative. The maximum of the whole clip becomes 255.
    dynamic_range_dB
        This far below the maximum, and lower, is 0.

    Returns
    -------
    Same shape, uint8.
    """
    reference = images.max()
    if not reference > 0 or not np.isfinite(reference):
        raise ValueError("The clip holds no echo: its envelope is zero or not finite.")
    floor = 10 ** (-dynamic_range_dB / 20)
    level = 20 * np.log10(np.maximum(images / reference, floor))
    return np.rint(255 * (1 + level / dynamic_range_dB)).astype(np.uint8)


def downsample(images: np.ndarray, divisor: int) -> np.ndarray:
    """Means of divisor x divisor blocks, rounded.

    Parameters
    ----------
    images
        Shape (..., axial, lateral), uint8, both a multiple of `divisor`.
    divisor
        Pixels along the side of a block.

    Returns
    -------
    Shape (..., axial / divisor, lateral / divisor), uint8. Halves go to the even neighbour, so nothing drifts.
    """
    *rest, rows, columns = images.shape
    if rows % divisor or columns % divisor:
        raise ValueError(f"An image of {rows} x {columns} px cannot be divided into blocks of {divisor} px.")
    from skimage.transform import downscale_local_mean

    means = downscale_local_mean(images.astype(np.float32), (*np.ones(len(rest), int), divisor, divisor))
    return np.rint(means).astype(np.uint8)


def clip(lines: np.ndarray, angle: np.ndarray, range_: np.ndarray, bmode: Bmode) -> dict[int, np.ndarray]:
    """B-mode clips of all sizes kept.

    Parameters
    ----------
    lines
        Shape (frames, lines, ranges), complex64.
    angle, range_
        Of lines (rad) and samples (m), evenly spaced.
    bmode
        Field of view, sizes and dynamic range.

    Returns
    -------
    Size in pixels to clip, shape (frames, size, size), uint8.
    """
    convert = ScanConversion(angle, range_, bmode)
    images = np.stack([convert(envelope(frame)) for frame in lines])
    full = log_compress(images, bmode.dynamic_range_dB)
    return {size: downsample(full, bmode.size_px // size) for size in bmode.sizes}

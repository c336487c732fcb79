"""B-mode: from lines to 8-bit images on the square field of view.

The envelope is interpolated before it is compressed, which keeps the statistics of the speckle, and compressed relative
to one reference for the whole clip, so that brightness means the same in every frame.
"""

import numpy as np

from echotruth.config import Bmode, Probe
from echotruth.imaging import spline
from echotruth.imaging.beamforming.scan import Scan


def time_gain_compensation(probe: Probe, bmode: Bmode, range_: np.ndarray) -> np.ndarray:
    """Gain exp(2 a f r) against the two-way attenuation at the centre frequency f, shape (ranges,), 1, float32.

    Parameters
    ----------
    probe, bmode
        The attenuation a of the tissue, unless `bmode.tgc_dB_per_cm_MHz` is set in its place.
    range_
        Shape (ranges,), m.
    """
    p, tgc = probe.si(), bmode.si().tgc
    attenuation = p.attenuation if tgc is None else tgc
    with np.errstate(over="ignore"):
        return np.exp(2 * attenuation * p.frequency * range_).astype(np.float32)


def envelope(lines: np.ndarray, gain: np.ndarray | float = 1.0) -> np.ndarray:
    """Envelope, float32, of demodulated or analytic lines (..., ranges), complex64, times a gain (ranges,)."""
    return np.abs(lines) * np.asarray(gain, np.float32)


def pixel_centres(bmode: Bmode, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Axial and lateral coordinates of the pixel centres of a square image, each of shape (size,), m.

    The array is at the middle of the upper edge: axial runs from 0 to the side, lateral from minus to plus half of it.
    """
    side = bmode.si().field_of_view
    axial = (np.arange(size) + 0.5) * side / size
    return axial, axial - side / 2


class ScanConversion:
    """Interpolation from lines to pixels by cubic splines over line and range; set up once for a clip.

    Parameters
    ----------
    scan
        The lines.
    range_
        Ranges of the samples, shape (ranges,), m, evenly spaced.
    bmode
        Field of view and size of the image.
    """

    def __init__(self, scan: Scan, range_: np.ndarray, bmode: Bmode):
        self._shape = (bmode.size_px, bmode.size_px)
        axial, lateral = np.meshgrid(*pixel_centres(bmode, bmode.size_px), indexing="ij")
        line, pixel_range = scan.to_scan_coordinates(lateral, axial)
        sample = (pixel_range - range_[0]) / (range_[1] - range_[0])
        inside = (line >= 0) & (line <= len(scan.angle) - 1) & (sample >= 0) & (sample <= len(range_) - 1)
        self._inside = np.flatnonzero(inside)
        self._line, self._sample = line[inside].astype(np.float32), sample[inside].astype(np.float32)

    def __call__(self, envelopes: np.ndarray) -> np.ndarray:
        """Image (axial, lateral) of the envelopes (lines, ranges), float32; 0 outside the scan, never negative."""
        image, values = np.zeros(self._shape, np.float32), np.empty(len(self._inside), np.float32)
        padded = spline.coefficients(np.ascontiguousarray(envelopes, np.float32))
        spline.evaluate(padded, self._line, self._sample, values)
        # The spline may undershoot beside an edge; an envelope is not negative.
        image.ravel()[self._inside] = np.maximum(values, 0)
        return image


def log_compress(images: np.ndarray, dynamic_range_dB: float) -> np.ndarray:
    """Eight-bit images 255 (1 + 20 log10(envelope / maximum) / dynamic range) of a clip.

    Parameters
    ----------
    images
        Envelopes, any shape. The maximum of the whole clip becomes 255.
    dynamic_range_dB
        Envelopes this far below the maximum, and lower ones, become 0.

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
    Shape (..., axial / divisor, lateral / divisor), uint8. Halves are rounded to even, so that there is no bias.
    """
    *rest, rows, columns = images.shape
    if rows % divisor or columns % divisor:
        raise ValueError(f"An image of {rows} x {columns} px cannot be divided into blocks of {divisor} px.")
    blocks = images.reshape(*rest, rows // divisor, divisor, columns // divisor, divisor)
    return np.rint(blocks.mean(axis=(-3, -1), dtype=np.float32)).astype(np.uint8)


def envelope_images(lines: np.ndarray, scan: Scan, range_: np.ndarray, bmode: Bmode, gain=1.0) -> np.ndarray:
    """Scan-converted envelopes of a clip, before log compression.

    Parameters
    ----------
    lines
        Shape (frames, lines, ranges), complex64.
    scan, range_
        The lines, and the ranges of their samples (ranges,), m, evenly spaced.
    bmode
        Field of view and size of the image.
    gain
        Over range, shape (ranges,), 1; see :func:`time_gain_compensation`.

    Returns
    -------
    Shape (frames, axial, lateral), float32; 0 outside the scan.
    """
    convert = ScanConversion(scan, range_, bmode)
    return np.stack([convert(envelope(frame, gain)) for frame in lines])


def bmode_clip(lines: np.ndarray, scan: Scan, range_: np.ndarray, bmode: Bmode, gain=1.0) -> dict[int, np.ndarray]:
    """B-mode clips of all image sizes; parameters as of :func:`envelope_images`.

    Returns
    -------
    Size in pixels to clip, shape (frames, size, size), uint8.
    """
    largest = largest_clip(lines, scan, range_, bmode, gain)
    return {size: downsample(largest, bmode.size_px // size) for size in bmode.sizes}


def largest_clip(lines: np.ndarray, scan: Scan, range_: np.ndarray, bmode: Bmode, gain=1.0) -> np.ndarray:
    """B-mode clip of the largest image size (frames, size, size), uint8; parameters as of :func:`envelope_images`."""
    return log_compress(envelope_images(lines, scan, range_, bmode, gain), bmode.dynamic_range_dB)

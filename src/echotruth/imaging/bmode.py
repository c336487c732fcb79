"""B-mode: from lines to 8-bit images on the square field of view.

The envelope is interpolated before it is compressed, which keeps the statistics of the speckle, and compressed relative
to one reference for the whole clip, so that brightness means the same in every frame. What a scanner does to compressed
images comes last, before they are rounded to eight bits: persistence, smoothing, edge enhancement, grey map.
"""

import numpy as np

from echotruth.config import Bmode, Probe
from echotruth.config.imaging import Dropout
from echotruth.imaging.beamforming.scan import Scan
from echotruth.units import MHz, dB_per_cm_MHz, mm

DROPOUT_WAVES = 64
"""Waves of which the random function of :func:`dropout_gain` is the sum."""


def time_gain_compensation(probe: Probe, bmode: Bmode, range_: np.ndarray) -> np.ndarray:
    """Gain exp(2 a f r) against the two-way attenuation at the centre frequency f, shape (ranges,), 1, float32.

    Parameters
    ----------
    probe, bmode
        The attenuation a of the tissue, unless `bmode.tgc_dB_per_cm_MHz` is set in its place, and the curve
        `bmode.time_gain`, which multiplies the gain.
    range_
        Shape (ranges,), m.
    """
    tgc, curve = bmode.tgc_dB_per_cm_MHz, bmode.time_gain
    attenuation = (probe.attenuation_dB_per_cm_MHz if tgc is None else tgc) * dB_per_cm_MHz
    with np.errstate(over="ignore"):
        gain = np.exp(2 * attenuation * (probe.frequency_MHz * MHz) * range_)
        if curve.range_mm:
            gain *= 10 ** (np.interp(range_, np.array(curve.range_mm) * mm, curve.gain_dB) / 20)
        return gain.astype(np.float32)


def dropout_gain(
    dropout: Dropout, shape: tuple[int, int], range_: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Gain of the echoes, at most 1, shape (frames, lines, ranges), 1, float32; see `bmode.dropout`.

    The first loss in dB is the positive part of a random function of line, range and time: a sum of cosines of random
    phase, whose wave numbers are normally distributed, so that its correlation is Gaussian (Rahimi & Recht 2007, Random
    features for large-scale kernel machines). In time they are whole, so that it returns with the cycle. Numbers of
    lines, ranges and frames do not change it.

    Parameters
    ----------
    dropout
    shape
        Numbers of frames, of an even cycle, and of lines.
    range_
        Shape (ranges,), m, up to the depth.
    random
    """
    over_scan, over_depth = np.linspace(-1, 1, shape[1]), range_ / range_[-1]
    wave_number = random.standard_normal((2, DROPOUT_WAVES)) / dropout.width
    over_time = 2 * np.pi * np.rint(random.standard_normal(DROPOUT_WAVES))
    phase = random.uniform(0, 2 * np.pi, DROPOUT_WAVES)
    lines = np.exp(1j * (np.outer(over_scan / 2, wave_number[0]) + phase))
    waves = np.exp(1j * np.outer(wave_number[1], over_depth)) * np.sqrt(2 / DROPOUT_WAVES)
    edge = dropout.edge_loss_dB * np.outer(over_scan**2, over_depth**2)
    gain = np.empty((*shape, len(range_)), np.float32)
    for frame in range(shape[0]):
        moved = lines * np.exp(1j * over_time * frame / shape[0])
        loss = dropout.loss_dB * np.maximum((moved @ waves).real, 0) + edge
        gain[frame] = 10 ** (-loss / 20)
    return gain


def clip_gain(
    probe: Probe, bmode: Bmode, shape: tuple[int, int], range_: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Gain of the envelope before it is compressed.

    Parameters
    ----------
    probe, bmode
        As of :func:`time_gain_compensation`.
    shape
        Numbers of frames, of an even cycle, and of lines.
    range_
        Shape (ranges,), m.
    random
        For :func:`dropout_gain`.

    Returns
    -------
    Shape (frames, lines, ranges), 1, float32; a view of one line if no echoes drop out.
    """
    gain, dropout = time_gain_compensation(probe, bmode, range_), bmode.dropout
    drops = dropout.loss_dB or dropout.edge_loss_dB
    return gain * dropout_gain(dropout, shape, range_, random) if drops else np.broadcast_to(gain, (*shape, len(gain)))


def envelope(lines: np.ndarray, gain: np.ndarray | float = 1.0) -> np.ndarray:
    """Envelope, float32, of demodulated or analytic lines (..., lines, ranges), complex64, times a gain.

    The gain is a frame of that of :func:`clip_gain`, of a shape that broadcasts to (lines, ranges).
    """
    return np.abs(lines) * np.asarray(gain, np.float32)


def pixel_centres(bmode: Bmode, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Axial and lateral coordinates of the pixel centres of a square image, each of shape (size,), m.

    The array is at the middle of the upper edge: axial runs from 0 to the side, lateral from minus to plus half of it.
    """
    side = bmode.field_of_view_mm * mm
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

    Attributes
    ----------
    inside : ndarray of shape (axial, lateral), bool
        Pixels within the scan.
    """

    def __init__(self, scan: Scan, range_: np.ndarray, bmode: Bmode):
        self._shape = (bmode.size_px, bmode.size_px)
        axial, lateral = np.meshgrid(*pixel_centres(bmode, bmode.size_px), indexing="ij")
        line, pixel_range = scan.to_scan_coordinates(lateral, axial)
        sample = (pixel_range - range_[0]) / (range_[1] - range_[0])
        inside = (line >= 0) & (line <= len(scan.angle) - 1) & (sample >= 0) & (sample <= len(range_) - 1)
        self.inside, self._inside = inside, np.flatnonzero(inside)
        self._line, self._sample = line[inside].astype(np.float32), sample[inside].astype(np.float32)

    def __call__(self, envelopes: np.ndarray) -> np.ndarray:
        """Image (axial, lateral) of the envelopes (lines, ranges), float32; 0 outside the scan, never negative."""
        image = np.zeros(self._shape, np.float32)
        # The spline may undershoot beside an edge; an envelope is not negative.
        image.ravel()[self._inside] = np.maximum(self.interpolated(envelopes), 0)
        return image

    def interpolated(self, samples: np.ndarray) -> np.ndarray:
        """Values of samples (lines, ranges) at the pixels within the scan, in their order, float32."""
        from echotruth.imaging import spline  # compiled; whoever reads a clip needs but the centres of its pixels

        values = np.empty(len(self._inside), np.float32)
        padded = spline.coefficients(np.ascontiguousarray(samples, np.float32))
        spline.evaluate(padded, self._line, self._sample, values)
        return values


def log_compress(images: np.ndarray, dynamic_range_dB: float, gain_dB: float = 0.0) -> np.ndarray:
    """Grey levels 1 + (20 log10(envelope / maximum) + gain) / dynamic range of a clip, limited to 0 and 1.

    Parameters
    ----------
    images
        Envelopes, any shape. Without gain the maximum of the whole clip becomes 1.
    dynamic_range_dB
        Envelopes this far below the level that is white, and lower ones, become 0.
    gain_dB
        Envelopes this far below the maximum, and higher ones, become 1.

    Returns
    -------
    Same shape, float32 if the envelopes are.
    """
    reference = images.max()
    if not reference > 0 or not np.isfinite(reference):
        raise ValueError("The clip holds no echo: its envelope is zero or not finite.")
    levels = images / reference
    levels *= 10 ** (gain_dB / 20)
    # In place, because memory is what this takes.
    np.log10(np.clip(levels, 10 ** (-dynamic_range_dB / 20), 1, out=levels), out=levels)
    levels *= 20
    levels /= dynamic_range_dB
    levels += 1
    return np.maximum(levels, 0, out=levels)


def persist(levels: np.ndarray, weight: float, is_closed: bool = True) -> np.ndarray:
    """Images of which each is averaged with those before it.

    y[k] = (1 - w) x[k] + w y[k - 1], where y[-1] is the last image of the same cycle. If the first image began without
    a past, it alone would have no lag, and the last one would not lead back to it. In a clip that is no closed cycle,
    y[-1] is the first image x[0].

    Parameters
    ----------
    levels
        Grey levels x (frames, axial, lateral).
    weight
        Weight w of the image before, from 0 to below 1.
    is_closed
        Whether the clip is a cycle that repeats.

    Returns
    -------
    y, same shape and type.
    """
    shown, before = np.empty_like(levels), np.zeros_like(levels[0]) if is_closed else levels[0]
    for frame, level in enumerate(levels):
        before = shown[frame] = (1 - weight) * level + weight * before
    if not is_closed:
        return shown
    # So far the cycle began in the dark. What the last image would have left over fades through all of them.
    last = before / (1 - weight ** len(levels))
    for frame in range(len(levels)):
        shown[frame] += weight ** (frame + 1) * last
    return shown


def sharpened(level: np.ndarray, inside: np.ndarray, amount: float, width_px: float) -> np.ndarray:
    """x + a (x - Gaussian mean of x) within the scan: an unsharp mask where a > 0, less speckle where a < 0.

    Parameters
    ----------
    level
        Grey levels x (axial, lateral).
    inside
        Pixels of the scan (axial, lateral), bool. The mean is that over these alone, so that the edge of the scan is no
        edge of the image; others stay what they are.
    amount
        Factor a, from -1.
    width_px
        Standard deviation of the Gaussian, px.

    Returns
    -------
    Same shape and type.
    """
    from scipy.ndimage import gaussian_filter  # takes longer to import than all else here

    weight = gaussian_filter(inside.astype(level.dtype), width_px)
    mean = gaussian_filter(np.where(inside, level, 0), width_px) / np.where(inside, weight, 1)
    return np.where(inside, level + amount * (level - mean), level)


def eight_bit(levels: np.ndarray, bmode: Bmode) -> np.ndarray:
    """Grey levels, limited to 0 and 1, through `bmode.grey_map` and `grey_gamma`, as uint8 of the same shape."""
    shown = np.clip(levels, 0, 1)
    if bmode.grey_map == "s_curve":
        shown = shown**2 * (3 - 2 * shown)
    if bmode.grey_gamma != 1:
        shown = shown**bmode.grey_gamma
    return np.rint(255 * shown).astype(np.uint8)


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
        Of :func:`clip_gain`, 1; of any shape that broadcasts to that of the lines.

    Returns
    -------
    Shape (frames, axial, lateral), float32; 0 outside the scan.
    """
    convert = ScanConversion(scan, range_, bmode)
    gains = np.broadcast_to(np.asarray(gain, np.float32), lines.shape)
    return np.stack([convert(envelope(*each)) for each in zip(lines, gains, strict=True)])


def bmode_clip(
    lines: np.ndarray, scan: Scan, range_: np.ndarray, bmode: Bmode, gain=1.0, is_closed: bool = True
) -> dict[int, np.ndarray]:
    """B-mode clips of all image sizes; parameters as of :func:`largest_clip`.

    Returns
    -------
    Size in pixels to clip, shape (frames, size, size), uint8.
    """
    largest = largest_clip(lines, scan, range_, bmode, gain, is_closed)
    return {size: downsample(largest, bmode.size_px // size) for size in bmode.sizes}


def largest_clip(
    lines: np.ndarray, scan: Scan, range_: np.ndarray, bmode: Bmode, gain=1.0, is_closed: bool = True
) -> np.ndarray:
    """B-mode clip of the largest image size (frames, size, size), uint8.

    Parameters are those of :func:`envelope_images`, and whether the clip is a cycle that repeats.
    """
    has_filter = bmode.smoothing or bmode.edge_enhancement
    inside = ScanConversion(scan, range_, bmode).inside if has_filter else np.ones(1, bool)
    return grey_images(envelope_images(lines, scan, range_, bmode, gain), inside, bmode, is_closed)


def volume_images(volumes: np.ndarray, step: np.ndarray, gain: np.ndarray, bmode: Bmode, is_closed: bool) -> np.ndarray:
    """B-mode of volumes.

    Parameters
    ----------
    volumes, step
        As :meth:`.VolumeSequence.volumes` returns them.
    gain
        Of :func:`time_gain_compensation`, shape (axial,).
    bmode, is_closed
        As of :func:`grey_images`.

    Returns
    -------
    Shape (frames, axial, elevation, lateral), uint8.
    """
    images = np.empty(volumes.shape[:-1], np.float32)
    for image, parts, one in zip(images, volumes, step.astype(np.float32), strict=True):
        np.multiply(np.abs((parts * one).view(np.complex64)[..., 0]), gain[:, None, None], out=image)
    return grey_images(images, np.ones(images.shape[1:], bool), bmode, is_closed)


def grey_images(images: np.ndarray, inside: np.ndarray, bmode: Bmode, is_closed: bool = True) -> np.ndarray:
    """Envelopes, compressed and filtered as a scanner does.

    Parameters
    ----------
    images
        Shape (frames, axial, lateral) or (frames, axial, elevation, lateral), float32.
    inside
        Pixels within the scan, bool, of the shape of one frame.
    bmode
        Its compression and filters.
    is_closed
        Whether the clip is a cycle that repeats.

    Returns
    -------
    Same shape, uint8.
    """
    levels = log_compress(images, bmode.dynamic_range_dB, bmode.gain_dB)
    if bmode.persistence:
        levels = persist(levels, bmode.persistence, is_closed)
    if bmode.smoothing or bmode.edge_enhancement:
        levels = np.stack([_filtered(level, inside, bmode) for level in levels])
    return np.stack([eight_bit(level, bmode) for level in levels])


def _filtered(level: np.ndarray, inside: np.ndarray, bmode: Bmode) -> np.ndarray:
    """Grey levels (axial, lateral), smoothed and then with enhanced edges, as asked for."""
    steps = (-bmode.smoothing, bmode.smoothing_width_px), (bmode.edge_enhancement, bmode.edge_width_px)
    for amount, width_px in steps:
        if amount:
            level = sharpened(level, inside, amount, width_px)
    return level

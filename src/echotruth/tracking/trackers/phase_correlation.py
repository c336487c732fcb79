"""Displacement between two images by phase-only correlation of windows (Kuglin and Hines 1975), the paper's tracker.

The paper prints argmax F^-1(W1 conj(W2) / |W1 conj(W2)|). With the usual transform, F(k) = sum f(x) exp(-i k x),
that peak lies at minus the motion; here the other factor is conjugated and the peak lies at the motion itself,
positive from the first image to the second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from echotruth.config.tracking import PhaseCorrelation
from echotruth.tracking.accumulation import accumulate
from echotruth.tracking.windows import SMALLEST, Windows, arrange

ABSENT = 1e-9
"""Magnitude of a frequency over the greatest that is nothing but rounding, whose phase is left to chance."""
FAINTEST = 1 / 255
"""Standard deviation of a window over the range of the clip below which it counts as without texture: a grey level."""


def track(
    frames: np.ndarray,
    points: np.ndarray,
    mask: np.ndarray,
    spacing: float,
    frame_time: np.ndarray,
    seed: int,
    settings: PhaseCorrelation,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame: see :func:`echotruth.tracking.tracker.track`.

    The quality is the height of the correlation peak. Windows cover the image whatever the mask.
    """
    windows = arrange(frames.shape[1:], window_side(settings, spacing), settings.stride)
    finite = frames[np.isfinite(frames)] if frames.dtype.kind == "f" else frames
    contrast = float(finite.max()) - float(finite.min()) if finite.size else 0.0
    pairs = PhasePairs(windows, settings.taper, contrast, max(settings.floor, ABSENT))
    return accumulate(pairs, frames, points, settings.reference)


def window_side(settings: PhaseCorrelation, spacing: float) -> int:
    """Side of a window at one image size.

    Parameters
    ----------
    settings : PhaseCorrelation
        The window in pixels or in millimetres of tissue.
    spacing : float
        Distance of pixel centres, m.

    Returns
    -------
    int
        px; a window in millimetres is rounded to an even number, 8 at least.
    """
    if settings.window_px is not None:
        return settings.window_px
    return max(SMALLEST, 2 * round(settings.si().window / spacing / 2))


@dataclass(frozen=True)
class PhasePairs:
    """Phase correlation of two images, as :class:`echotruth.tracking.accumulation.Pairs`.

    Attributes
    ----------
    windows : Windows
        Where to look.
    taper : {"none", "hann"}
        Weights over a window.
    contrast : float
        Range of grey values in the clip.
    floor : float
        Magnitude over the greatest from which on a frequency counts.
    """

    windows: Windows
    taper: str
    contrast: float
    floor: float

    def prepare(self, image: np.ndarray) -> Phases:
        """:func:`phases` of an image."""
        return phases(image, self.windows, self.taper, self.contrast, self.floor)

    def match(self, first: Phases, second: Phases, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points, linear between the windows."""
        moved, peak = displacement(first, second, self.windows.side)
        step = self.windows.interpolate(np.concatenate([moved, peak[..., None]], -1), points)
        return step[:, :2], step[:, 2]


@dataclass(frozen=True)
class Phases:
    """Transforms of windows with the magnitude taken out.

    Attributes
    ----------
    seen : ndarray of shape (rows, columns), bool
        Windows that have texture.
    unit : ndarray of shape (n, side, side // 2 + 1), complex
        Theirs: unit numbers; 0 where a frequency does not count.
    """

    seen: np.ndarray
    unit: np.ndarray


def phases(image: np.ndarray, windows: Windows, taper: str, contrast: float, floor: float = ABSENT) -> Phases:
    """Transforms of the windows of an image with the magnitude taken out.

    Parameters
    ----------
    image : ndarray of shape (axial, lateral)
        Grey values.
    windows : Windows
        Where to look.
    taper : {"none", "hann"}
        Weights over a window, on its departure from its mean.
    contrast : float
        Range of grey values in the clip, against which texture is judged.
    floor : float
        Magnitude over the greatest from which on a frequency counts.

    Returns
    -------
    Phases
    """
    side = windows.side
    cut = windows.cut(image)
    cut -= cut.mean((-2, -1), keepdims=True)
    seen = cut.std((-2, -1)) > FAINTEST * (contrast or np.inf)
    cut = cut[seen]
    if taper == "hann":
        # Sampled at pixel centres, so that the weights are symmetric and none is lost to zero.
        hann = np.sin(np.pi * (np.arange(side) + 0.5) / side) ** 2
        cut *= hann[:, None] * hann
    spectrum = fft.rfft2(cut)
    magnitude = np.abs(spectrum)
    present = magnitude > floor * magnitude.max((-2, -1), keepdims=True)
    return Phases(seen, np.divide(spectrum, magnitude, out=np.zeros_like(spectrum), where=present))


def displacement(first: Phases, second: Phases, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Motion of the tissue in every window from the first image to the second.

    Parameters
    ----------
    first, second : Phases
        Of the two images.
    side : int
        Side of a window, px.

    Returns
    -------
    displacement : ndarray of shape (rows, columns, 2)
        Lateral, axial, px, within half a window; NaN where either window has no texture.
    quality : ndarray of shape (rows, columns)
        Height of the correlation peak: 1 for a whole-pixel shift of the same texture, near 0 for unlike ones.
    """
    seen = first.seen & second.seen
    plane = fft.irfft2(
        first.unit[second.seen[first.seen]].conj() * second.unit[first.seen[second.seen]], s=(side, side)
    )
    every, flat = np.arange(len(plane)), plane.reshape(len(plane), side**2)
    axial, lateral = np.divmod(flat.argmax(-1), side)
    peak = flat.max(-1)
    shift = []
    for i, j, place in ((0, 1, lateral), (1, 0, axial)):
        before = plane[every, (axial - i) % side, (lateral - j) % side]
        after = plane[every, (axial + i) % side, (lateral + j) % side]
        whole = (place + side // 2) % side - side // 2
        shift.append(whole + fraction(before, peak, after))
    moved, quality = np.full((*seen.shape, 2), np.nan), np.full(seen.shape, np.nan)
    moved[seen], quality[seen] = np.stack(shift, -1), peak
    return moved, quality


def fraction(before: np.ndarray, peak: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Sub-pixel place of a phase-correlation peak: the centroid of it and its neighbours, where they are above 0.

    The peak of a shifted texture of all frequencies is sin(pi x) / (pi x) about the shift, whose lesser neighbour is
    below 0: then the larger neighbour over its sum with the peak is the fraction (Foroosh, Zerubia and Berthod 2002,
    IEEE Trans Image Process 11:188, equation 12). A parabola through the three values falls short by up to 0.17 px.
    Where frequencies do not count the peak is wider, and the lesser neighbour takes its part.

    Parameters
    ----------
    before, peak, after : ndarray of one shape
        Correlation one pixel before the peak, at it and after it.

    Returns
    -------
    ndarray of the same shape
        px, within -0.5 to 0.5.
    """
    before, after = np.maximum(before, 0), np.maximum(after, 0)
    return np.divide(after - before, before + peak + after, out=np.full_like(peak, np.nan), where=peak > 0)

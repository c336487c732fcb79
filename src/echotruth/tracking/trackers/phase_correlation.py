"""Displacement between two images by phase-only correlation of windows (Kuglin and Hines 1975), the paper's tracker.

The paper prints argmax F^-1(W1 conj(W2) / |W1 conj(W2)|). With the usual transform, F(k) = sum f(x) exp(-i k x), that
peak lies at minus the displacement; here the other factor is conjugated and the peak lies at the displacement from the
first image to the second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from echotruth.config.tracking import PhaseCorrelation
from echotruth.tracking.accumulation import Path, follow
from echotruth.tracking.grey import MIN_STD, amplitudes
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.windows import MIN_WINDOW_SIDE, Windows, arrange
from echotruth.units import mm

ROUNDING = 1e-9
"""Magnitude, relative to the largest, of a frequency that is rounding error and has a random phase."""


def track(clip: TrackerInput, settings: PhaseCorrelation) -> Path:
    """Path of the points of a clip, with the height of the correlation peaks.

    Windows cover the whole image; the mask is not used.
    """
    windows = arrange(clip.shape, window_side(settings, clip.spacing), settings.stride)
    images = amplitudes(clip.frames, settings.dynamic_range_dB) if settings.dynamic_range_dB else clip.frames
    finite = images[np.isfinite(images)] if images.dtype.kind == "f" else images
    contrast = float(finite.max()) - float(finite.min()) if finite.size else 0.0
    tracker = PhaseCorrelationTracker(windows, settings.taper, contrast, max(settings.spectral_threshold, ROUNDING))
    return follow(tracker, images, clip.points, settings.reference)


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
    assert settings.window_mm is not None
    return max(MIN_WINDOW_SIDE, 2 * round(settings.window_mm * mm / spacing / 2))


@dataclass(frozen=True)
class PhaseCorrelationTracker:
    """Phase correlation of two images, as :class:`echotruth.tracking.accumulation.PairTracker`.

    Attributes
    ----------
    windows : Windows
    taper : {"none", "hann"}
        Weights of the pixels of a window.
    contrast : float
        Range of grey values in the clip; a window with less than 1/255 of it as standard deviation has no texture.
    spectral_threshold : float
        Magnitude, relative to the largest, below which a frequency is left out.
    """

    windows: Windows
    taper: str
    contrast: float
    spectral_threshold: float = ROUNDING

    def prepare(self, image: np.ndarray) -> PhaseSpectra:
        """Fourier transforms of the windows of an image (axial, lateral), normalised to unit magnitude.

        Their means are subtracted before the taper; frequencies below the spectral threshold are 0.
        """
        side = self.windows.side
        values = self.windows.extract(image)
        values -= values.mean((-2, -1), keepdims=True)
        textured = values.std((-2, -1)) > MIN_STD * (self.contrast or np.inf)
        values = values[textured]
        if self.taper == "hann":
            # Sampled at pixel centres, so that the weights are symmetric and none is 0.
            hann = np.sin(np.pi * (np.arange(side) + 0.5) / side) ** 2
            values *= hann[:, None] * hann
        spectrum = fft.rfft2(values)
        magnitude = np.abs(spectrum)
        used = magnitude > self.spectral_threshold * magnitude.max((-2, -1), keepdims=True)
        return PhaseSpectra(textured, np.divide(spectrum, magnitude, out=np.zeros_like(spectrum), where=used))

    def match(self, first: PhaseSpectra, second: PhaseSpectra, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step (n, 2) in px and quality (n,) of points, linear between the windows."""
        shift, peak = window_shifts(first, second, self.windows.side)
        values = self.windows.interpolate(np.concatenate([shift, peak[..., None]], -1), points)
        return values[:, :2], values[:, 2]


@dataclass(frozen=True)
class PhaseSpectra:
    """Fourier transforms of windows, normalised to unit magnitude.

    Attributes
    ----------
    textured : ndarray of shape (rows, columns), bool
        Windows that have texture.
    spectrum : ndarray of shape (n, side, side // 2 + 1), complex
        Of these windows; 0 at frequencies that are left out.
    """

    textured: np.ndarray
    spectrum: np.ndarray


def window_shifts(first: PhaseSpectra, second: PhaseSpectra, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of the tissue in each window from the first image to the second.

    Parameters
    ----------
    first, second : PhaseSpectra
        Of the two images.
    side : int
        Side of a window, px.

    Returns
    -------
    shift : ndarray of shape (rows, columns, 2)
        Lateral, axial, px, within half a window; NaN where either window has no texture.
    peak : ndarray of shape (rows, columns)
        Height of the correlation peak: 1 for a whole-pixel shift of the same texture, near 0 for unrelated ones.
    """
    textured = first.textured & second.textured
    spectra = first.spectrum[second.textured[first.textured]], second.spectrum[first.textured[second.textured]]
    correlation = fft.irfft2(spectra[0].conj() * spectra[1], s=(side, side))
    window, flat = np.arange(len(correlation)), correlation.reshape(len(correlation), side**2)
    axial, lateral = np.divmod(flat.argmax(-1), side)
    largest = flat.max(-1)
    components = []
    for i, j, lag in ((0, 1, lateral), (1, 0, axial)):
        before = correlation[window, (axial - i) % side, (lateral - j) % side]
        after = correlation[window, (axial + i) % side, (lateral + j) % side]
        whole_pixels = (lag + side // 2) % side - side // 2
        components.append(whole_pixels + subpixel_offset(before, largest, after))
    shift, peak = np.full((*textured.shape, 2), np.nan), np.full(textured.shape, np.nan)
    shift[textured], peak[textured] = np.stack(components, -1), largest
    return shift, peak


def subpixel_offset(before: np.ndarray, peak: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Sub-pixel position of a phase-correlation peak: centroid of the peak and its neighbours, where above 0.

    The peak of a shifted texture of all frequencies is sin(pi x) / (pi x) about the shift, whose smaller neighbour is
    below 0: then the larger neighbour over its sum with the peak is the offset (Foroosh, Zerubia and Berthod 2002,
    IEEE Trans Image Process 11:188, equation 12). A parabola through the three values falls short by up to 0.17 px.
    Where frequencies are left out the peak is wider, and the smaller neighbour contributes.

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

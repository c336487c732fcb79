"""The phased array: elements, weights, pulse, directivity and the beam in elevation.

Frame of the probe: origin at the centre of the array, coordinates in the order lateral, axial, elevation.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi, sqrt

import numba
import numpy as np

from echotruth.config import Probe

FAINTEST = 0.01
"""Spectrum of the pulse, relative to its maximum, below which it is cut (-40 dB)."""
HIGHEST = 0.46
"""Highest frequency of the pulse over the sampling frequency; above it echoes cannot be deposited accurately."""


def element_centres(probe: Probe) -> np.ndarray:
    """Lateral coordinates of the element centres, shape (elements,), m."""
    p = probe.si()
    return (np.arange(p.elements) - (p.elements - 1) / 2) * p.pitch


def apodization(probe: Probe, kind: str) -> np.ndarray:
    """Weights of the elements over the aperture, shape (elements,), 1.

    `hann` is cos^2(pi x / L) at the element centres x, with L = elements * pitch, so the outermost elements still
    count; `none` is all ones.
    """
    if kind == "none":
        return np.ones(probe.elements)
    if kind == "hann":
        aperture = probe.elements * probe.si().pitch
        return np.cos(pi * element_centres(probe) / aperture) ** 2
    raise ValueError(f"Apodization {kind!r} is not known: use 'hann' or 'none'.")


def spectral_width(probe: Probe) -> float:
    """Standard deviation of the Gaussian two-way spectrum (amplitude), Hz.

    The amplitude falls to one half (-6 dB) at half the bandwidth from the centre frequency.
    """
    return probe.bandwidth * probe.si().frequency / 2 / sqrt(2 * log(2))


def pulse_band(probe: Probe) -> tuple[float, float]:
    """Lowest and highest frequency of the pulse, Hz: where its spectrum is cut off."""
    p = probe.si()
    half = spectral_width(probe) * sqrt(-2 * log(FAINTEST))
    return max(p.frequency - half, 0.0), min(p.frequency + half, HIGHEST * p.sampling)


def pulse_spectrum(probe: Probe, frequency: np.ndarray) -> np.ndarray:
    """Spectrum of the two-way pulse, real and without delay.

    A sinusoid at the centre frequency in a Gaussian window, cut to :func:`pulse_band`.

    Parameters
    ----------
    frequency
        Any shape, Hz.

    Returns
    -------
    Same shape, 1; 1 at the centre frequency.
    """
    frequency = np.asarray(frequency, float)
    low, high = pulse_band(probe)
    gaussian = np.exp(-((frequency - probe.si().frequency) ** 2) / (2 * spectral_width(probe) ** 2))
    return np.where((frequency >= low) & (frequency <= high), gaussian, 0.0)


def pulse(probe: Probe, time: np.ndarray) -> np.ndarray:
    """The two-way pulse as it is seen, its peak at time 0.

    Parameters
    ----------
    time
        Shape (samples,), s.

    Returns
    -------
    Shape (samples,), 1: the real part of the inverse transform of :func:`pulse_spectrum`, 1 at time 0.
    """
    low, high = pulse_band(probe)
    frequency = np.linspace(low, high, 1025)
    spectrum = pulse_spectrum(probe, frequency)
    return np.cos(2 * pi * np.multiply.outer(np.asarray(time, float), frequency)) @ spectrum / spectrum.sum()


@numba.njit(cache=True)
def directivity(sine, cosine, width):
    """Amplitude of a strip element in a soft baffle: sinc(width * sine) * cosine.

    Selfridge, Kino, Khuri-Yakub 1980, Appl Phys Lett 37:35.

    Parameters
    ----------
    sine, cosine
        Of the angle to the axial axis, any shape, 1.
    width
        Width of the element in wavelengths. Taken at the centre frequency for the whole pulse, which errs by
        about one per cent of the RF.
    """
    return np.sinc(width * sine) * cosine


@dataclass(frozen=True)
class ElevationProfile:
    """Two-way amplitude of the beam in elevation, tabulated over slope (elevation / range) and 1 / range.

    The profile is that of the centre frequency, and only its amplitude: bandwidth is left out, and so is the delay
    of the lens against the straight path from the centre of the element. For the default array and scatterers
    within 0.8 mm of the plane the RF then differs from that of the broadband Fresnel integral by 21 % in the focus
    (bandwidth alone), 30-40 % at 5, 8 and 9.3 mm and 85 % at 3.7 mm. Most of what grows away from the focus is a
    delay common to all scatterers of one range, that is a shift in depth by a few micrometres; with the delay at
    the centre frequency 21-27 % would remain.
    """

    weight: np.ndarray
    """Two-way amplitude, shape (curvatures, slopes), 1; 1 on the axis at the elevation focus."""
    curvature: np.ndarray
    """1 / range of the rows, shape (curvatures,), 1/m, evenly spaced."""
    slope: np.ndarray
    """Elevation over range of the columns, shape (slopes,), 1, evenly spaced from 0."""

    @classmethod
    def of(cls, probe: Probe, depth: float) -> ElevationProfile:
        """Tabulate the profile of a probe from half an element height to `depth` (m)."""
        p = probe.si()
        wavelength = p.sound_speed / p.frequency
        steepest = 1.0
        slopes = int(24 * steepest * p.height / wavelength) + 2
        slope = np.linspace(0, steepest, slopes)
        curvature = np.linspace(min(1 / depth, 1 / p.height), 2 / p.height, 192)
        amplitude = [elevation_amplitude(probe, slope / c, 1 / c) for c in curvature]
        return cls(np.array(amplitude), curvature, slope)

    def __call__(self, elevation: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """Two-way amplitude at `elevation` (n,) m and in-plane range `reach` (n,) m: shape (n,), 1.

        Bilinear in the table; steeper than its last column is 0, nearer than its last row is as on that row.
        """
        row = (1 / reach - self.curvature[0]) / (self.curvature[1] - self.curvature[0])
        row = np.clip(row, 0, len(self.curvature) - 1.001)
        column = np.abs(elevation) / reach / self.slope[1]
        inside = column < len(self.slope) - 1
        column = np.where(inside, column, 0.0)
        i, j = row.astype(np.intp), column.astype(np.intp)
        u, v = row - i, column - j
        near = (1 - v) * self.weight[i, j] + v * self.weight[i, j + 1]
        far = (1 - v) * self.weight[i + 1, j] + v * self.weight[i + 1, j + 1]
        return np.where(inside, (1 - u) * near + u * far, 0.0)


def elevation_amplitude(probe: Probe, elevation: np.ndarray, reach: float) -> np.ndarray:
    """Two-way amplitude in elevation of an element with a lens, at the centre frequency.

    The Fresnel integral over the height H of the element (Goodman, Introduction to Fourier Optics, section 4.2),
    squared for transmit and receive: `|1/H int exp(i k [h^2/2 (1/r - 1/F) - h y/r]) dh|^2`, by Gauss-Legendre
    quadrature.

    Parameters
    ----------
    elevation
        y, shape (n,), m.
    reach
        r, range in the plane of the image, m.

    Returns
    -------
    Shape (n,), 1; 1 on the axis at the elevation focus F.
    """
    p = probe.si()
    wavenumber = 2 * pi * p.frequency / p.sound_speed
    slope = np.asarray(elevation, float) / reach
    defocus = 1 / reach - 1 / p.elevation_focus
    # The phase of the integrand turns by at most this much from the middle of the element to its edge.
    turn = wavenumber * p.height / 2 * (np.abs(slope).max() + abs(defocus) * p.height / 4)
    node, share = np.polynomial.legendre.leggauss(32 + int(turn))
    height = node * p.height / 2
    phase = wavenumber * (defocus * height**2 / 2 - np.multiply.outer(slope, height))
    return np.abs((np.exp(1j * phase) * (share / 2)).sum(axis=1)) ** 2

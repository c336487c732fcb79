"""The exact sum: every term of every pair of elements and frequency in float64, written from the formulas alone.

It is what :class:`~echotruth.imaging.rf.full_matrix.FullMatrix` approximates, and serves to measure its error:

    S_ij(f) = P(f) sum_k a_k (f / f0)^n_k u_ki(f) u_kj(f)
    u(f)    = D(f) E(f) exp(-alpha f r) exp(-2 pi i f r / c) / r
    D(f)    = sinc(pi w f sin(theta) / c) cos(theta)
    E(f)    = 1/H int exp(-i k [h^2/2 (1/r' - 1/F) - h y/r']) dh,  k = 2 pi f / c,

with the pulse P of centre frequency f0, the amplitude a of a scatterer and its exponent n, and for each element its
distance r and angle theta to a scatterer at elevation y, its range r' in the plane of the image, width w, height H and
elevation focus F, and the attenuation alpha. A harmonic is sent with E(f / 2)^2 in place of E(f), and is the mean of
S_ij and S_ji.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.imaging.flow import fresnel
from echotruth.imaging.rf.probe import element_centres, pulse_band, pulse_spectrum
from echotruth.imaging.rf.shadow import Rib
from echotruth.units import MHz, um

Spectra = NDArray[np.complex128]


def exact_matrix(
    probe: Probe,
    position: Floats,
    amplitude: Floats,
    frequency: Floats,
    *,
    exponent: Floats | float = 0.0,
    elevation: bool = True,
    harmonic: bool = False,
    rib: Rib | None = None,
) -> Spectra:
    """Echoes S between all pairs.

    Parameters
    ----------
    probe : Probe
    position : ndarray of shape (scatterers, 3), m
        Lateral, axial, elevation.
    amplitude : ndarray of shape (scatterers,)
        At the centre frequency.
    frequency : ndarray of shape (bins,), Hz
    exponent : ndarray of shape (scatterers,), or float
        Power of the frequency that the amplitude follows.
    elevation : bool
        Whether the lens is there; without it E = 1.
    harmonic : bool
        Whether the wave is sent at half of the frequency.
    rib : Rib, optional
        Each way u is multiplied by its transmission.

    Returns
    -------
    ndarray of shape (bins, elements, elements), 1/m^2
    """
    passes = rib.transmission(position, element_centres(probe)).T if rib else 1.0
    matrix = []
    for f, pulse in zip(frequency, pulse_spectrum(probe, frequency), strict=True):
        wave = sent = passes * one_way(probe, position, f, elevation=elevation)
        if harmonic:
            sent = passes * one_way(probe, position, f, elevation=elevation, sent=True)
        scattered = amplitude * (f / (probe.frequency_MHz * MHz)) ** exponent
        echoes = pulse * (wave * scattered) @ sent.T
        matrix.append((echoes + echoes.T) / 2)
    return np.array(matrix)


def one_way(probe: Probe, position: Floats, frequency: float, *, elevation: bool = True, sent: bool = False) -> Spectra:
    """Wave u of every element at every scatterer (n, 3), m, at a frequency, Hz: (elements, scatterers), 1/m.

    That of the harmonic of what is `sent`, if it is at half of the frequency.
    """
    speed = probe.sound_speed_m_per_s
    lateral = position[:, 0] - element_centres(probe)[:, None]
    distance = np.sqrt(lateral**2 + position[:, 1] ** 2 + position[:, 2] ** 2)
    # NumPy's sinc(x) is sin(pi x) / (pi x).
    directivity = np.sinc(probe.width_um * um * frequency / speed * lateral / distance) * position[:, 1] / distance
    attenuation = probe.attenuation_dB_per_cm_MHz * 100 / 1e6 * np.log(10) / 20  # nepers per metre and hertz
    wave = directivity * np.exp(-(attenuation + 2j * np.pi / speed) * frequency * distance) / distance
    if not elevation:
        return wave
    return wave * (fresnel(probe, position, frequency / 2) ** 2 if sent else fresnel(probe, position, frequency))


def pulse(probe: Probe, time: np.ndarray) -> np.ndarray:
    """The two-way pulse in time, its peak at time 0.

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
    return np.cos(2 * np.pi * np.multiply.outer(np.asarray(time, float), frequency)) @ spectrum / spectrum.sum()

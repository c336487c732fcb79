"""The exact sum: every term of every pair and frequency in float64, written from the formulas alone."""

import numpy as np


def directivities(probe, position, frequency):
    """sinc(pi w f sin(theta) / c) cos(theta) over the distance, (elements, scatterers), and the distance, m."""
    lateral = position[:, 0] - centres(probe)[:, None]
    distance = np.sqrt(lateral**2 + position[:, 1] ** 2 + position[:, 2] ** 2)
    argument = probe.width_um * 1e-6 * frequency / probe.sound_speed_m_per_s * lateral / distance
    return np.sinc(argument) * position[:, 1] / distance**2, distance


def centres(probe):
    return (np.arange(probe.elements) - (probe.elements - 1) / 2) * probe.pitch_um * 1e-6


def fresnel(probe, position, frequency):
    """Mean over the height of a lens of the phase beyond the straight path to its centre, (elements, scatterers)."""
    reach = np.hypot(position[:, 0] - centres(probe)[:, None], position[:, 1])[..., None]
    node, share = np.polynomial.legendre.leggauss(240)
    height, focus = node * probe.height_mm * 1e-3 / 2, probe.elevation_focus_mm * 1e-3
    path = height**2 / 2 * (1 / reach - 1 / focus) - height * position[:, 2, None] / reach
    return np.exp(-2j * np.pi * frequency / probe.sound_speed_m_per_s * path) @ (share / 2)


def exact_matrix(probe, position, amplitude, frequency, lens=False):
    """Echoes between all pairs at frequencies (bins,), Hz: shape (bins, elements, elements)."""
    centre, speed = probe.frequency_MHz * 1e6, probe.sound_speed_m_per_s
    deviation = probe.bandwidth * centre / np.sqrt(8 * np.log(2))
    loss = probe.attenuation_dB_per_cm_MHz * 1e-6 * 100 / (20 * np.log10(np.e))
    matrix = np.empty((len(frequency), probe.elements, probe.elements), complex)
    for k, f in enumerate(frequency):
        loud, distance = directivities(probe, position, f)
        wave = loud * np.exp(-(loss + 2j * np.pi / speed) * f * distance)
        if lens:
            wave = wave * fresnel(probe, position, f)
        matrix[k] = np.exp(-((f - centre) ** 2) / (2 * deviation**2)) * (wave * amplitude) @ wave.T
    return matrix

"""Haze: reverberation of what lies near the array.

Sound that went to and fro between array, skin and ribs arrives later than the direct echo, so it is drawn deeper; but
its wavefront is still that of the near position, so it is out of focus there and smeared over the lines. Byram & Shu
(2016, J Med Imaging 3:046005) simulate it so: linear echoes of near scatterers, shifted later by random times. With
times from an exponential distribution, some in every resolution cell, they reproduce the statistics of clutter. They
are attenuated on their further way and spread on it, as from the farthest of what is near.
"""

from math import ceil, log, pi, sqrt

import numpy as np

from echotruth.config import Probe
from echotruth.config.realism import Haze
from echotruth.imaging.rf.probe import spectral_width
from echotruth.units import dB_per_cm_MHz, mm

ECHOES_PER_CELL = 2
"""Later echoes per axial resolution cell: two reproduce the measured speckle statistics of clutter (Byram & Shu)."""
MAX_LENGTHS = 4
"""Later echoes are drawn up to this many means of their distance."""


def reverberation(haze: Haze, probe: Probe, depth: float, random: np.random.Generator) -> np.ndarray:
    """Draw the later echoes of an echo from near the array.

    Parameters
    ----------
    haze, probe
        Their settings.
    depth
        Greatest range of interest, m; echoes that would appear deeper are left out.
    random
        Generator; the echoes are the same in all frames, because array, skin and ribs do not move.

    Returns
    -------
    Shape (echoes, 2): apparent additional depth, m, and amplitude relative to the first echo.
    """
    assert haze.level_dB is not None
    mean, farthest = haze.mean_extra_range_mm * mm, haze.max_source_range_mm * mm
    resolution = probe.sound_speed_m_per_s / 2 * sqrt(2) * log(2) / pi / spectral_width(probe)
    number = ceil(ECHOES_PER_CELL * MAX_LENGTHS * mean / resolution)
    deeper = random.exponential(mean, number)
    spread = farthest / (farthest + deeper)
    amplitude = random.standard_normal(number) * 10 ** (haze.level_dB / 20) * spread / np.linalg.norm(spread)
    return np.column_stack([deeper, amplitude])[deeper < depth - farthest]


def reverberation_filter(echoes: np.ndarray, probe: Probe, frequency: np.ndarray) -> np.ndarray:
    """Transfer function sum_n A_n exp(-2 (2 pi i / c + alpha) f d_n) of later echoes (echoes, 2): depth d, amplitude A.

    They go the additional way through tissue that attenuates by alpha as all tissue does. The first echo is not in it.
    At frequencies (bins,), Hz: shape (bins,), complex.
    """
    decay = 2j * np.pi / probe.sound_speed_m_per_s + probe.attenuation_dB_per_cm_MHz * dB_per_cm_MHz
    way = np.multiply.outer(frequency, 2 * echoes[:, 0])
    return (np.exp(-decay * way) * echoes[:, 1]).sum(axis=1)

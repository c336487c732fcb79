"""Aberration: tissue of differing speeds of sound near the array delays what each element sends and receives.

The tissue is a thin screen on the array: element i is late by tau_i each way, whatever the direction (Flax & O'Donnell
1988, IEEE Trans Ultrason Ferroelectr Freq Control 35:758, near-field phase screen). The beam loses exp(-(2 pi f tau)^2)
of the power at its focus each way, for delays of standard deviation tau that differ from element to element, and has
more of it beside the focus.
"""

from math import log

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.config.realism import Aberration
from echotruth.imaging.rf.probe import element_centres
from echotruth.units import mm, ns, um

STEPS = 8
"""Random numbers in a correlation length, at least, of which delays are the weighted sum."""
CUT = 2.0
"""Correlation lengths from an element beyond which no random number counts; its weight is exp(-8 ln 2 CUT^2) there."""


def delays(aberration: Aberration, probe: Probe, random: np.random.Generator) -> Floats:
    """Draw the delays of the elements, (elements,), s.

    They are normally distributed with the correlation 2^-(2 x / L)^2 at a distance x, L being the correlation length.
    Their mean and their slope along the array, which would only shift and turn the image, are taken out, and their root
    mean square is then that of the key.
    """
    length, centres = aberration.correlation_length_mm * mm, element_centres(probe)
    step, margin = min(length / STEPS, probe.pitch_um * um), CUT * length
    place = np.arange(centres[0] - margin, centres[-1] + margin + step, step)
    # Its correlation with itself is that of the delays.
    weight = np.exp(-8 * log(2) * ((centres[:, None] - place) / length) ** 2)
    drawn = weight @ random.standard_normal(len(place))
    drawn -= drawn.mean()
    if len(centres) > 2:
        drawn -= centres * (centres @ drawn) / (centres @ centres)
    rms = np.sqrt(np.square(drawn).mean())
    return drawn * (aberration.delay_ns * ns / rms) if rms else drawn


def phasors(delay: Floats, frequency: Floats) -> np.ndarray:
    """exp(-2 pi i f tau) at frequencies (bins,), Hz, for delays (elements,), s: (bins, elements), complex."""
    return np.exp(-2j * np.pi * np.multiply.outer(frequency, delay))

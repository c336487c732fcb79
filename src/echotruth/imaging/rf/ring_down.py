"""Ring-down: sound that goes to and fro between the array and the outer face of its lens.

The face is a mirror at a distance d, from which element j hears element i as if it stood at a distance 2 k d behind
the mirror after k round trips, in line with the array: over a path hypot(2 k d, x_i - x_j). So a bright band with
fading repetitions lies at ranges k d, the same in all frames, as array and lens are at rest with each other.
"""

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Probe
from echotruth.imaging.rf.probe import element_centres, pulse_spectrum
from echotruth.units import MHz

THICKNESS = 12
"""Wavelengths from array to face, chosen by eye: 5.4 mm in people, 0.74 mm in mice."""
ROUND_TRIPS, LOSS_DB = 5, 8.0
"""Round trips that are heard, and what each loses, by eye."""


def ring_down(probe: Probe, frequency: NDArray[np.float64]) -> NDArray[np.complex64]:
    """Spectra (bins, elements) at even frequencies (bins,), Hz, of what an element hears of one at such a distance."""
    speed, centres = probe.sound_speed_m_per_s, element_centres(probe)
    trip, delay = np.arange(1, ROUND_TRIPS + 1), 2 * THICKNESS / (probe.frequency_MHz * MHz)
    # What comes after the end of the record would wrap around to its beginning.
    trip = trip[delay * trip < 1 / (frequency[1] - frequency[0])]
    path = np.hypot(speed * delay * trip[:, None], centres - centres[0])
    wave = np.exp(-2j * np.pi / speed * np.multiply.outer(frequency, path))
    echoes = np.tensordot(wave, 10 ** (-LOSS_DB / 20 * (trip - 1)), (1, 0))
    return (pulse_spectrum(probe, frequency)[:, None] * echoes).astype(np.complex64)


def add(record: NDArray[np.complex64], spectra: NDArray[np.complex64]) -> None:
    """Add spectra (bins, elements), by the distance of a pair, to the record (bins, elements, elements) of all."""
    elements = np.arange(record.shape[1])
    for element in elements:
        record[:, element] += spectra[:, np.abs(elements - element)]

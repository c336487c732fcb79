"""Errors of ours and of PyMUST against the exact sum, in double precision."""

from __future__ import annotations

from typing import Any

import numpy as np
from acoustics_agreement import FINE, likeness
from acoustics_arrays import ARRAYS, Array, Floats, delays
from acoustics_peers import Pymust
from exact_sum import Spectra, exact_matrix, one_way

from echotruth.config import Probe
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.probe import element_centres, pulse_spectrum

SCATTERERS, EVERY = 150, 8
"""Scatterers, and the bins that are summed: one in so many."""
ATTENUATIONS = (0.0, 0.5)
"""dB/cm/MHz."""


def with_delay_twice(probe: Probe, position: Floats, amplitude: Floats, frequency: Floats) -> Spectra:
    """The exact sum where a scatterer at elevation y has the delay y^2 / (2 r c) beside that of its distance r.

    PyMUST 0.1.9 adds it. Shape (bins, elements, elements).
    """
    lateral, (_, axial, elevation) = position[:, 0] - element_centres(probe)[:, None], position.T
    delay = elevation**2 / 2 / np.sqrt(lateral**2 + axial**2 + elevation**2) / probe.si().sound_speed
    waves = (one_way(probe, position, f) * np.exp(-2j * np.pi * f * delay) for f in frequency)
    pulse = pulse_spectrum(probe, frequency)
    return np.array([p * (wave * amplitude) @ wave.T for p, wave in zip(pulse, waves, strict=True)])


OURS: dict[str, dict[str, Any]] = {
    "ours": {"elevation": False},
    "ours, elevation": {"elevation": True},
}


def exactness(array: str) -> list[list[Any]]:
    """Rows of simulator, plane or slab, attenuation (dB/cm/MHz) and relative L2 error."""
    setup, rows = ARRAYS[array], []
    for name, options in OURS.items():
        position, amplitude = setup.scatterers(SCATTERERS, thick=options["elevation"])
        for attenuation in ATTENUATIONS:
            probe = setup.probe(attenuation_dB_per_cm_MHz=attenuation)
            ours = FullMatrix(probe, setup.far, **options)
            sums = exact_matrix(probe, position, amplitude, ours.frequency[::EVERY], elevation=options["elevation"])
            difference = ours(position, amplitude)[::EVERY] - sums
            error = float(np.linalg.norm(difference) / np.linalg.norm(sums))
            rows.append([name, "slab" if options["elevation"] else "plane", attenuation, error])
    return rows + [pymust(setup, twice) for twice in (False, True)]


def pymust(array: Array, twice: bool) -> list[Any]:
    """Row of PyMUST through the slab, against the exact sum or that of :func:`with_delay_twice`."""
    probe = array.probe()
    position, amplitude = array.scatterers(SCATTERERS, thick=True)
    ours, delay = FullMatrix(probe, array.far), delays(probe, (0.0, probe.si().elevation_focus))
    bins = ours.first_bin + np.arange(0, len(ours.frequency), EVERY)
    step = ours.sampling / ours.samples
    theirs = Pymust(probe, elevation=True, **FINE).spectra(position, amplitude, delay, bins, step)
    theirs = theirs * pulse_spectrum(probe, bins * step)[:, None]
    phase = np.exp(-2j * np.pi * np.outer(bins * step, delay))
    exact = (with_delay_twice if twice else exact_matrix)(probe, position, amplitude, bins * step)
    sums = np.einsum("fij,fi->fj", exact, phase)
    name = "PyMUST, the elevation delay twice in the sum" if twice else "PyMUST"
    return [name, "slab", 0.0, likeness(sums, theirs)["error"]]

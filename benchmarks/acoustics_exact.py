"""Errors of ours and of PyMUST against the exact sum, in double precision."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from acoustics_agreement import FEW, FINE, likeness
from acoustics_arrays import ARRAYS, Array, Floats, delays
from acoustics_peers import PATCHES, Esdiva, Pymust
from exact_sum import Spectra, exact_matrix, one_way

from echotruth.config import Probe
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.probe import element_centres, pulse_spectrum
from echotruth.units import mm

SCATTERERS, EVERY = 150, 8
"""Scatterers, and the bins that are summed: one in so many."""
ATTENUATIONS = (0.0, 0.5)
"""dB/cm/MHz."""


def with_delay_twice(probe: Probe, position: Floats, amplitude: Floats, frequency: Floats) -> Spectra:
    """The exact sum where a scatterer at elevation y has the delay y^2 / (2 r c) beside that of its distance r.

    PyMUST 0.1.9 adds it. Shape (bins, elements, elements).
    """
    lateral, (_, axial, elevation) = position[:, 0] - element_centres(probe)[:, None], position.T
    delay = elevation**2 / 2 / np.sqrt(lateral**2 + axial**2 + elevation**2) / probe.sound_speed_m_per_s
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
    slab = {"thick": True, "elevation": True} | FINE
    rows.append(["PyMUST", "slab", 0.0, pymust(setup, **slab)])
    rows.append(["PyMUST, the elevation delay twice in the sum", "slab", 0.0, pymust(setup, twice=True, **slab)])
    return rows


def errors(array: str) -> dict[str, list[float | None]]:
    """Party to its error in the plane, elements being points in elevation, and through the slab under the lens."""
    setup = ARRAYS[array]
    ours = {name: error for name, _, attenuation, error in exactness(array) if not attenuation}
    found: dict[str, list[float | None]] = {
        "ours": [ours["ours"], None],
        "ours, elevation": [ours["ours"], ours["ours, elevation"]],
        "eSDIva": [esdiva(setup, 1, thick=False), None],
        "eSDIva, elevation": [esdiva(setup, PATCHES, thick=False), esdiva(setup, PATCHES, thick=True)],
    }
    for name, options in {"PyMUST": FINE, "PyMUST as it comes": {}}.items():
        found[name] = [pymust(setup, **options), None]
        thick = {"elevation": True} | options
        found[f"{name}, elevation"] = [pymust(setup, **thick), pymust(setup, thick=True, **thick)]
    return found


def esdiva(array: Array, patches: int, *, thick: bool) -> float:
    """Relative L2 error of eSDIva's matrix."""
    probe = (array.probe if thick else array.thin)()
    position, amplitude = array.scatterers(FEW, thick=thick)
    ours = FullMatrix(probe, array.far, elevation=thick)
    frequency = ours.frequency[::EVERY]
    theirs = Esdiva(probe, ours.sampling, patches).spectra(position, amplitude, frequency)
    theirs = theirs * pulse_spectrum(probe, frequency)[:, None, None]
    return likeness(exact_matrix(probe, position, amplitude, frequency, elevation=thick), theirs)["error"]


def pymust(array: Array, *, thick: bool = False, twice: bool = False, **options: Any) -> float:
    """Relative L2 error of PyMUST against the exact sum or that of :func:`with_delay_twice`."""
    probe = (array.probe if thick else array.thin)()
    position, amplitude = array.scatterers(SCATTERERS, thick=thick)
    ours, delay = FullMatrix(probe, array.far, elevation=thick), delays(probe, (0.0, probe.elevation_focus_mm * mm))
    bins = ours.first_bin + np.arange(0, len(ours.frequency), EVERY)
    step = ours.sampling / ours.samples
    theirs = Pymust(probe, **options).spectra(position, amplitude, delay, bins, step)
    theirs = theirs * pulse_spectrum(probe, bins * step)[:, None]
    phase = np.exp(-2j * np.pi * np.outer(bins * step, delay))
    exact = with_delay_twice if twice else partial(exact_matrix, elevation=thick)
    sums = np.einsum("fij,fi->fj", exact(probe, position, amplitude, bins * step), phase)
    return likeness(sums, theirs)["error"]

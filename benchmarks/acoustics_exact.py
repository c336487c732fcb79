"""Errors of ours and of the peers against the exact sum, in double precision."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from acoustics_agreement import FEW, FINE, likeness
from acoustics_arrays import ARRAYS, Array, Floats, delays
from acoustics_peers import PATCHES, Esdiva, FastSimus, Pymust, Zea
from exact_sum import Spectra, exact_matrix, one_way

from echotruth.config import Probe
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.probe import element_centres, pulse_spectrum
from echotruth.units import mm

SCATTERERS, EVERY = 150, 8
"""Scatterers, and the bins that are summed: one in so many."""
ATTENUATIONS = (0.0, 0.5)
"""dB/cm/MHz."""

Law = Callable[[Probe, Floats, float], Spectra | Floats]
"""Probe, scatterers and frequency (Hz) to a factor (elements, scatterers) on the wave of each way."""


def delay_twice(probe: Probe, position: Floats, frequency: float) -> Spectra:
    """A scatterer at elevation y has the delay y^2 / (2 r c) beside that of its distance r; PyMUST 0.1.9 adds it."""
    delay = position[:, 2] ** 2 / 2 / distance(probe, position) / probe.sound_speed_m_per_s
    return np.exp(-2j * np.pi * frequency * delay)


def rigid_baffle(probe: Probe, position: Floats, frequency: float) -> Floats:
    """The directivity lacks the cosine of the angle; so has zea 0.1.8."""
    return distance(probe, position) / position[:, 1]


def two_dimensions(probe: Probe, position: Floats, frequency: float) -> Floats:
    """The loss over distance is 1/sqrt(r) on each way; so it is in FastSIMUS 0.0.1."""
    return np.sqrt(distance(probe, position))


def distance(probe: Probe, position: Floats) -> Floats:
    """Of every element from every scatterer, shape (elements, scatterers), m."""
    lateral = position[:, 0] - element_centres(probe)[:, None]
    return np.sqrt(lateral**2 + position[:, 1] ** 2 + position[:, 2] ** 2)


def changed_matrix(
    law: Law, probe: Probe, position: Floats, amplitude: Floats, frequency: Floats, *, elevation: bool
) -> Spectra:
    """The exact sum with a law of a peer on each way; shape (bins, elements, elements)."""
    waves = (law(probe, position, f) * one_way(probe, position, f, elevation=elevation) for f in frequency)
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
    fast = {"fine": True, "widest": True}
    return [
        *rows,
        ["PyMUST, the elevation delay twice in the sum", "slab", 0.0, transmit(Pymust, setup, law=delay_twice, **slab)],
        ["zea, a rigid baffle in the sum", "plane", 0.0, transmit(Zea, setup, law=rigid_baffle)],
        ["FastSIMUS, 1/sqrt(r) in the sum", "plane", 0.0, transmit(FastSimus, setup, law=two_dimensions, **fast)],
    ]


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
        found[name] = [transmit(Pymust, setup, **options), None]
        lens = {"elevation": True} | options
        found[f"{name}, elevation"] = [transmit(Pymust, setup, **lens), transmit(Pymust, setup, thick=True, **lens)]
    for name, in_time in {"zea": False, "zea in time": True}.items():
        lens = {"lens": True, "in_time": in_time}
        found[name] = [transmit(Zea, setup, in_time=in_time), transmit(Zea, setup, thick=True, **lens)]
    for name, fine in {"FastSIMUS": True, "FastSIMUS as it comes": False}.items():
        found[name] = [transmit(FastSimus, setup, fine=fine, widest=True), None]
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


def transmit(
    peer: Callable[..., Any], array: Array, *, thick: bool = False, law: Law | None = None, **options: Any
) -> float:
    """Relative L2 error of one transmit of a peer against the exact sum, or that with a law of the peer."""
    probe = (array.probe if thick else array.thin)()
    position, amplitude = array.scatterers(SCATTERERS, thick=thick)
    ours, delay = FullMatrix(probe, array.far, elevation=thick), delays(probe, (0.0, probe.elevation_focus_mm * mm))
    bins = ours.first_bin + np.arange(0, len(ours.frequency), EVERY)
    step = ours.sampling / ours.samples
    frequency = bins * step
    theirs = peer(probe, **options).spectra(position, amplitude, delay, bins, step)
    theirs = theirs * pulse_spectrum(probe, frequency)[:, None]
    phase = np.exp(-2j * np.pi * np.outer(frequency, delay))
    exact = partial(changed_matrix, law) if law else exact_matrix
    sums = np.einsum("fij,fi->fj", exact(probe, position, amplitude, frequency, elevation=thick), phase)
    heard = np.isfinite(theirs[:, 0])
    return likeness(sums[heard], theirs[heard])["error"]

"""The sum that all simulators stand for, in double precision: over scatterers, elements, frequencies and heights."""

from __future__ import annotations

from typing import Any

import numpy as np
from acoustics_agreement import FINE, likeness
from acoustics_arrays import ARRAYS, Array, Floats, delays
from acoustics_peers import Pymust
from numpy.typing import NDArray

from echotruth.config import Probe
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.probe import element_centres, pulse_spectrum

Spectra = NDArray[np.complex128]

SCATTERERS, EVERY = 150, 8
"""Scatterers, and the bins that are summed: one in so many."""
ATTENUATIONS = (0.0, 0.5)
"""dB/cm/MHz."""


def one_way(
    probe: Probe, position: Floats, frequency: float, *, elevation: bool = True, twice: bool = False
) -> Spectra:
    """What scatterers hear of every element alone at a frequency (Hz), without pulse, (elements, scatterers), 1/m.

    Directivity of a strip in a soft baffle, 1/r, attenuation, and, unless `elevation` is left out, the Fresnel integral
    over the height of the element with its lens, by Gauss-Legendre quadrature. `twice` adds the delay y^2 / (2 r c) of
    a scatterer at elevation y to that which the distance r has already, as PyMUST 0.1.9 does.
    """
    p = probe.si()
    lateral, axial, beside = position[:, 0] - element_centres(probe)[:, None], position[:, 1], position[:, 2]
    plane = np.hypot(lateral, axial)
    distance = np.hypot(plane, beside)
    sharp = np.sinc(p.width * frequency / p.sound_speed * lateral / distance) * axial / distance / distance
    # dB/cm/MHz to nepers per metre.
    loss = probe.attenuation_dB_per_cm_MHz * 100 * frequency / 1e6 * np.log(10) / 20
    path = distance + (beside**2 / 2 / distance if twice else 0.0)
    wavenumber = 2 * np.pi * frequency / p.sound_speed
    wave = sharp * np.exp(-loss * distance - 1j * wavenumber * path)
    if not elevation:
        return wave
    return wave * fresnel(wavenumber, p.height, 1 / plane - 1 / p.elevation_focus, beside / plane)


def fresnel(wavenumber: float, height: float, defocus: Floats, slope: Floats) -> Spectra:
    """1/H int exp(-i k [h^2/2 defocus - h slope]) dh over the height H (m), shape of defocus (1/m) and slope (1)."""
    turn = wavenumber * height / 2 * (np.abs(slope).max() + np.abs(defocus).max() * height / 4)
    node, share = np.polynomial.legendre.leggauss(24 + int(turn))
    sums = np.zeros(defocus.shape, complex)
    for h, weight in zip(node * height / 2, share / 2, strict=True):
        sums += weight * np.exp(-1j * wavenumber * (h**2 / 2 * defocus - h * slope))
    return sums


def matrix(probe: Probe, position: Floats, amplitude: Floats, frequency: Floats, **options: Any) -> Spectra:
    """Echoes between all pairs at frequencies (bins,), shape (bins, elements, elements)."""
    found = []
    for each, pulse in zip(frequency, pulse_spectrum(probe, frequency), strict=True):
        wave = one_way(probe, position, each, **options)
        found.append(pulse * (wave * amplitude) @ wave.T)
    return np.array(found)


OURS: dict[str, dict[str, Any]] = {
    "ours, 2e-5": {"accuracy": 2e-5, "elevation": False},
    "ours, 1e-3": {"accuracy": 1e-3, "elevation": False},
    "ours, elevation": {"elevation": True},
}


def exactness(array: str) -> list[list[Any]]:
    """Who, in the plane or through the slab, attenuation (dB/cm/MHz) and relative L2."""
    given, rows = ARRAYS[array], []
    for name, options in OURS.items():
        position, amplitude = given.scatterers(SCATTERERS, thick=options["elevation"])
        for attenuation in ATTENUATIONS:
            probe = given.probe(attenuation_dB_per_cm_MHz=attenuation)
            ours = FullMatrix(probe, given.far, **options)
            sums = matrix(probe, position, amplitude, ours.frequency[::EVERY], elevation=options["elevation"])
            away = ours(position, amplitude)[::EVERY] - sums
            error = float(np.linalg.norm(away) / np.linalg.norm(sums))
            rows.append([name, "slab" if options["elevation"] else "plane", attenuation, error])
    return rows + [pymust(given, twice) for twice in (False, True)]


def pymust(array: Array, twice: bool) -> list[Any]:
    """PyMUST through the slab, against the sum as it is and with the elevation delay that PyMUST counts twice."""
    probe = array.probe()
    position, amplitude = array.scatterers(SCATTERERS, thick=True)
    ours, delay = FullMatrix(probe, array.far), delays(probe, (0.0, probe.si().elevation_focus))
    bins = ours.first + np.arange(0, len(ours.frequency), EVERY)
    step = ours.sampling / ours.samples
    theirs = Pymust(probe, elevation=True, **FINE).spectra(position, amplitude, delay, bins, step)
    theirs = theirs * pulse_spectrum(probe, bins * step)[:, None]
    phase = np.exp(-2j * np.pi * np.outer(bins * step, delay))
    sums = np.einsum("fij,fi->fj", matrix(probe, position, amplitude, bins * step, twice=twice), phase)
    name = "PyMUST, the elevation delay twice in the sum" if twice else "PyMUST"
    return [name, "slab", 0.0, likeness(sums, theirs)["error"]]

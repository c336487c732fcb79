"""How far our echoes are from those of the peers, one setting at a time, and from the exact sum.

Compared are spectra over the band of our pulse, of one transmit for PyMUST (focused and steered by 15 degrees) and of
the whole matrix for eSDIva. The pulses differ, so each side's own is divided out of its spectra and ours is put on. By
Parseval's theorem the figures are those of the analytic RF.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from acoustics_arrays import ARRAYS, Array, delays
from acoustics_peers import Esdiva, Pymust
from numpy.typing import NDArray

from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.probe import pulse_spectrum
from echotruth.units import mm

Spectra = NDArray[np.complexfloating[Any, Any]]

SCATTERERS, FEW = 300, 20
"""For PyMUST, and for the matrix of eSDIva."""
STEERED = np.deg2rad(15)
FINE = {"FullFrequencyDirectivity": True, "ElementSplitting": 1}
"""Options of PyMUST that make its directivity ours: of every frequency, of the element as one piece."""
ATTENUATION = 0.5
"""dB/cm/MHz."""

PYMUST: dict[str, dict[str, Any]] = {
    "the same settings": FINE | {"elevation": True},
    "the same, with attenuation": FINE | {"elevation": True, "attenuation": ATTENUATION},
    "directivity of the centre frequency": {"ElementSplitting": 1, "elevation": True},
    "elements in two pieces": FINE | {"ElementSplitting": 2, "elevation": True},
    "rigid baffle": FINE | {"elevation": True, "changes": {"baffle": "rigid"}},
    "two dimensions": FINE,
    "lens and slab": FINE | {"elevation": True, "lens": True},
}
"""What PyMUST is set to; ours stays at the first, but for attenuation and lens."""


def likeness(ours: Spectra, theirs: Spectra) -> dict[str, float]:
    """Normalised correlation, relative L2 after the best common factor, and that factor on theirs."""
    ours = ours.astype(np.complex128)
    product = np.vdot(theirs, ours).real
    factor = product / np.vdot(theirs, theirs).real
    return {
        "correlation": float(product / np.linalg.norm(ours) / np.linalg.norm(theirs)),
        "error": float(np.linalg.norm(ours - factor * theirs) / np.linalg.norm(ours)),
        "factor": float(factor),
    }


def agreement(array: str) -> dict[str, dict[str, float]]:
    """Likeness to PyMUST under each setting, and to eSDIva."""
    answer = {f"PyMUST, {name}": to_pymust(ARRAYS[array], **setting) for name, setting in PYMUST.items()}
    answer["eSDIva, the same settings"] = to_esdiva(ARRAYS[array])
    return answer


def to_pymust(
    array: Array, *, elevation: bool = False, lens: bool = False, attenuation: float = 0.0, **options: Any
) -> dict[str, float]:
    """Likeness of one transmit, PyMUST in three dimensions (`elevation`), with points for elements or with a `lens`."""
    probe = (array.probe if lens else array.thin)(attenuation_dB_per_cm_MHz=attenuation)
    position, amplitude = array.scatterers(SCATTERERS, thick=lens)
    matrix, focus = FullMatrix(probe, array.far, elevation=lens), probe.elevation_focus_mm * mm
    delay = delays(probe, (focus * np.sin(STEERED), focus * np.cos(STEERED)))
    phase = np.exp(-2j * np.pi * np.outer(matrix.frequency, delay))
    ours = np.einsum("fij,fi->fj", matrix(position, amplitude), phase)
    bins, step = matrix.first_bin + np.arange(len(matrix.frequency)), matrix.sampling / matrix.samples
    theirs = Pymust(probe, elevation=elevation, **options).spectra(position, amplitude, delay, bins, step)
    return likeness(ours, theirs * pulse_spectrum(probe, matrix.frequency)[:, None])


def to_esdiva(array: Array) -> dict[str, float]:
    """Likeness of the whole matrix."""
    probe = array.thin()
    position, amplitude = array.scatterers(FEW)
    matrix = FullMatrix(probe, array.far, elevation=False)
    theirs = Esdiva(probe, matrix.sampling).spectra(position, amplitude, matrix.frequency)
    return likeness(matrix(position, amplitude), theirs * pulse_spectrum(probe, matrix.frequency)[:, None, None])

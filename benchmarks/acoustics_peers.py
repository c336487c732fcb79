"""PyMUST and eSDIva as calls on a probe of ours: scatterers in, echoes out.

Their documentation: https://github.com/creatis-ULTIM/PyMUST, https://github.com/EstebanRivera08/eSDIva
"""

from __future__ import annotations

import contextlib
import os
from importlib import import_module
from typing import Any

import numpy as np
from exact_sum import pulse
from numpy.typing import NDArray

from echotruth.config import Probe
from echotruth.imaging.rf.probe import spectral_width
from echotruth.units import MHz, mm, um

Floats = NDArray[np.float64]

IN_PLANE = 1e-8
"""Elevation, m, of a scatterer in the plane of the image: PyMUST turns to two dimensions where all are below 1e-9."""

NEPER_DB = 8.69
"""Decibels in a neper as PyMUST rounds them; there are 20 / ln 10 = 8.6859."""

WIDEST = 190.0
"""Bandwidth, %, of PyMUST's pulse where that is divided out: frequencies at which it is faint are not computed."""

PATCHES = 8
"""Parts in elevation of an element of eSDIva with its lens."""

TRUNCATION = 5.0
"""Half the length of eSDIva's sampled pulse, in standard deviations of its envelope."""


class Pymust:
    """One transmit by `pymust.simus`.

    Parameters
    ----------
    probe : Probe
    elevation : bool
        Whether in three dimensions (1/r on each way, elements of finite height with a lens) or in two (1/sqrt(r)).
    changes : dict, optional
        Fields of its `Param`.
    options
        Fields of its `Options`; what is not given is as PyMUST has it.
    """

    def __init__(self, probe: Probe, *, elevation: bool = False, changes: dict[str, Any] | None = None, **options: Any):
        import pymust

        self._simus, self._pulse, self._elevation = pymust.simus, pymust.getpulse, elevation
        self.param, self.options = pymust.utils.Param(), pymust.utils.Options()
        fields = {
            "fc": probe.frequency_MHz * MHz,
            "pitch": probe.pitch_um * um,
            "width": probe.width_um * um,
            "height": probe.height_mm * mm,
            "focus": probe.elevation_focus_mm * mm,
            "radius": np.inf,
            "bandwidth": 100 * probe.bandwidth,
            "baffle": "soft",
            "attenuation": probe.attenuation_dB_per_cm_MHz * NEPER_DB * np.log(10) / 20,
            "c": probe.sound_speed_m_per_s,
            "Nelements": probe.elements,
        }
        for name, value in (fields | (changes or {})).items():
            setattr(self.param, name, value)
        for name, value in options.items():
            setattr(self.options, name, value)

    def __call__(self, position: Floats, amplitude: Floats, delay: Floats) -> tuple[Floats, NDArray[np.complex64]]:
        """RF (samples, elements), and its spectra (frequencies from 0 to 2 fc, elements) with exp(+2 pi i f t)."""
        x, z = (np.ascontiguousarray(position[:, axis]) for axis in (0, 1))
        y = [np.where(position[:, 2] == 0, IN_PLANE, position[:, 2])] if self._elevation else []
        return self._simus(x, *y, z, amplitude, delay[None], self.param, self.options)

    def spectra(
        self, position: Floats, amplitude: Floats, delay: Floats, bins: NDArray[np.intp], step: float
    ) -> NDArray[np.complex128]:
        """Spectra without PyMUST's pulse and probe at frequencies that are whole multiples of a step.

        Its grid runs from 0 to twice the centre frequency, so the latter is put on the nearest multiple, which
        matters to the pulse alone, and that is divided out.

        Parameters
        ----------
        position, amplitude
            Scatterers.
        delay
            Of the elements, shape (elements,), s.
        bins
            Multiples asked for, shape (bins,).
        step
            Hz.

        Returns
        -------
        Shape (bins, elements), with exp(-2 pi i f t): echoes of a pulse whose spectrum is 1, in the unit of amplitude
        over area, m^2 (3-D) or over distance (2-D).
        """
        param = self.param
        param.bandwidth = WIDEST
        middle = round(param.fc / step)
        param.fc = middle * step
        # PyMUST's own step, and how finely it divides ours; a hair more, as it rounds the number of bins up.
        default = self._default_step(position, delay)
        finer = int(np.ceil(step / default))
        self.options.FrequencyStep = step / finer / default * (1 + 1e-9)
        _, spectra = self(position, amplitude, delay)
        frequency = bins * step
        wave = param.getPulseSpectrumFunction()(2 * np.pi * frequency)
        wave = wave * param.getProbeFunction()(2 * np.pi * frequency) ** 2
        # PyMUST multiplies by its step, and by the width in two dimensions; the height is in its sum of Gaussians.
        size = (param.height * gaussians()) ** 2 if self._elevation else param.width
        return np.conj(spectra[finer * bins] / wave[:, None]) / (step / finer * size)

    def _default_step(self, position: Floats, delay: Floats) -> float:
        """Frequency step that `simus` multiplies by its option, Hz."""
        centre = (np.arange(self.param.Nelements) - (self.param.Nelements - 1) / 2) * self.param.pitch
        farthest = np.hypot(position[:, :1] - centre, position[:, 1:2]).max()
        _, time = self._pulse(self.param, 2)
        return 1 / 2 / (2 * (farthest + time[-1] * self.param.c) / self.param.c + delay.max())


def gaussians() -> float:
    """Integral over elevation of the Gaussians that PyMUST takes for an element, over its height; 0.992."""
    weight, width = import_module("pymust.pfield").MGBMcoeff(4)
    return float(np.sum(weight * np.sqrt(np.pi / np.asarray(width))).real)


class Esdiva:
    """Pulse-echo RF by `esdiva.Reception`, its fastest method.

    Parameters
    ----------
    probe : Probe
        Attenuation is left out: its own is of another law (with dispersion).
    sampling : float, Hz
    patches : int
        Parts of an element in elevation; with one the lens is left out.
    """

    def __init__(self, probe: Probe, sampling: float, patches: int = 1):
        import esdiva

        shape = {
            "n_elements": probe.elements,
            "element_width_mm": probe.width_um / 1e3,
            "element_height_mm": probe.height_mm,
            "kerf_mm": (probe.pitch_um - probe.width_um) / 1e3,
            "no_sub_x": 1,
            "no_sub_y": patches,
            "elevation_focus_mm": probe.elevation_focus_mm if patches > 1 else None,
            "frequency_Hz": probe.frequency_MHz * MHz,
        }
        with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
            ends = [esdiva.transducers.LinearArrayTransducer(**shape) for _ in range(2)]
        for end in ends:
            end.baffle = "soft"
        half = int(TRUNCATION / (2 * np.pi * spectral_width(probe)) * sampling)
        self._time = np.arange(-half, half + 1) / sampling
        self._pulse = pulse(probe, self._time)
        speed = probe.sound_speed_m_per_s
        self._reception = esdiva.Reception(*ends, c=speed, fs=sampling, excitation=self._pulse, verbose=False)
        # rho / (2 c^2) is its factor on the echo, width height / (2 pi) that of each way.
        self._size = (probe.width_um * um * probe.height_mm * mm / 2 / np.pi) ** 2 / 2 / speed**2

    def __call__(self, position: Floats, amplitude: Floats, delay: Floats) -> tuple[Any, dict[str, Any]]:
        """RF of one transmit (1, elements, samples), and its time axis."""
        event = {"delays": delay, "apodization": np.ones(len(delay))}
        return self._reception.sequence_rf(1e3 * position[:, [0, 2, 1]], amplitude, [event])

    def matrix(self, position: Floats, amplitude: Floats) -> tuple[Any, dict[str, Any]]:
        """RF of every element alone (elements, elements, samples), and its time axis."""
        return self._reception.synthetic_aperture_rf(
            1e3 * position[:, [0, 2, 1]], amplitude, decimation=1, countdown=False
        )

    def spectra(self, position: Floats, amplitude: Floats, frequency: Floats) -> NDArray[np.complex128]:
        """Spectra of the matrix without the pulse at frequencies (bins,), shape (bins, elements, elements).

        Echoes of a pulse whose spectrum is 1, in the unit of amplitude over area, m^2.
        """
        # A silent scatterer far away, since the record ends before the pulse of the last echo does.
        far = 1.2 * np.linalg.norm(position, axis=1).max()
        rf, axis = self.matrix(np.append(position, [[0.0, far, 0.0]], axis=0), np.append(amplitude, 0.0))
        time = axis["t0"] + axis["dt"] * np.arange(rf.shape[2])
        wave = self._pulse @ np.exp(-2j * np.pi * np.outer(self._time, frequency))
        spectra = rf @ np.exp(-2j * np.pi * np.outer(time, frequency)) / wave
        return np.moveaxis(spectra, 2, 0) / self._size / (1 / axis["dt"])

"""Other simulators as calls on a probe of ours: scatterers in, echoes out.

Their documentation: https://github.com/creatis-ULTIM/PyMUST, https://github.com/EstebanRivera08/eSDIva,
https://zea.readthedocs.io, https://github.com/charlesbmi/FastSIMUS
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from exact_sum import pulse
from numpy.typing import NDArray

from echotruth.config import Probe
from echotruth.imaging.rf.probe import element_centres, spectral_width
from echotruth.units import MHz, mm, um

Floats = NDArray[np.float64]

IN_PLANE = 1e-8
"""Elevation, m, of a scatterer in the plane of the image: PyMUST turns to two dimensions where all are below 1e-9."""

NEPER_DB = 8.69
"""Decibels in a neper as PyMUST rounds them; there are 20 / ln 10 = 8.6859."""

WIDEST = 190.0
"""Bandwidth, %, of the pulse of PyMUST and FastSIMUS where that is divided out: frequencies at which it is faint are
not computed."""

PATCHES = 8
"""Parts in elevation of an element of eSDIva with its lens."""

TRUNCATION = 5.0
"""Half the length of eSDIva's sampled pulse, in standard deviations of its envelope."""

PERIODS = 4
"""Length of zea's pulse, under a Hann window."""

FAINT = 0.01
"""Spectrum of zea's pulse, relative to its maximum, below which it is not divided out: it has zeros in our band."""


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
        spectra = transform(rf, time, frequency) / wave
        return np.moveaxis(spectra, 2, 0) / self._size / (1 / axis["dt"])


class Zea:
    """One transmit by `zea.simulator.simulate_rf`, compiled by JAX at the first call for its number of scatterers.

    Its baffle is rigid, and its pulse has four periods at the centre frequency, whatever the bandwidth.

    Parameters
    ----------
    probe : Probe
    in_time : bool
        Whether by `simulate_rf_td`, with directivity and attenuation of the centre frequency.
    lens : bool
        Whether with its lens: scatterers beside the height of an element are silent, and transmits spread by 1/sqrt(r).
    """

    def __init__(self, probe: Probe, *, in_time: bool = False, lens: bool = False):
        os.environ.setdefault("KERAS_BACKEND", "jax")
        simulator, in_time_ = import_module("zea.simulator"), import_module("zea.simulator_time_domain")
        centre = element_centres(probe)
        self._probe = probe
        self._simulate = partial(
            in_time_.simulate_rf_td if in_time else simulator.simulate_rf,
            probe_geometry=np.stack([centre, 0 * centre, 0 * centre], axis=1),
            apply_lens_correction=False,
            lens_thickness=None,
            lens_sound_speed=None,
            sound_speed=probe.sound_speed_m_per_s,
            center_frequency=probe.frequency_MHz * MHz,
            sampling_frequency=probe.sampling_MHz * MHz,
            initial_times=np.zeros(1),
            element_width=probe.width_um * um,
            attenuation_coef=probe.attenuation_dB_per_cm_MHz,
            tx_apodizations=np.ones((1, probe.elements)),
            t_peak=np.zeros(1),
            elevation_lens=lens,
            element_height=probe.height_mm * mm if lens else None,
            scatter_exponent=0.0,
        )
        self._compiled: Callable[..., Any] | None = None

    def __call__(self, position: Floats, amplitude: Floats, delay: Floats) -> NDArray[np.float32]:
        """RF (samples, elements), the first sample at time 0."""
        if self._compiled is None:
            probe = self._probe
            flight = 2 * farthest(probe, position) / probe.sound_speed_m_per_s
            # The last echo, half its pulse, and two periods within which zea leaves echoes out.
            last = flight + delay.max() + (PERIODS / 2 + 2) / (probe.frequency_MHz * MHz)
            samples = int(np.ceil(last * probe.sampling_MHz * MHz))
            self._compiled = import_module("jax").jit(partial(self._simulate, n_ax=samples))
        return np.asarray(self._compiled(position[:, [0, 2, 1]], amplitude, t0_delays=delay[None]))[0, :, :, 0]

    def spectra(
        self, position: Floats, amplitude: Floats, delay: Floats, bins: NDArray[np.intp], step: float
    ) -> NDArray[np.complex128]:
        """Spectra without the pulse, as :meth:`Pymust.spectra` gives them but for a factor; NaN where that is faint."""
        rf, frequency = self(position, amplitude, delay), bins * step
        pulse_of_zea = import_module("zea.simulator").get_pulse_spectrum_fn(self._probe.frequency_MHz * MHz, PERIODS)
        wave = np.array(pulse_of_zea(frequency)).real
        wave[abs(wave) < FAINT * abs(wave).max()] = np.nan
        return (transform(rf.T, np.arange(len(rf)) / (self._probe.sampling_MHz * MHz), frequency) * (1 / wave)).T


class FastSimus:
    """One transmit by `fast_simus.simus_compute`, compiled by JAX at the first call for scatterers no farther away.

    It is in two dimensions (1/sqrt(r) on each way), with a soft baffle.

    Parameters
    ----------
    probe : Probe
    fine : bool
        Whether with directivity at every frequency, of the element as one piece.
    widest : bool
        Whether with a pulse that can be divided out.
    """

    def __init__(self, probe: Probe, *, fine: bool = False, widest: bool = False):
        import fast_simus

        self._probe, self._fine = probe, fine
        self._transducer = fast_simus.TransducerParams(
            freq_center=probe.frequency_MHz * MHz,
            pitch=probe.pitch_um * um,
            n_elements=probe.elements,
            width=probe.width_um * um,
            bandwidth=WIDEST / 100 if widest else probe.bandwidth,
        )
        self._medium = fast_simus.MediumParams(
            speed_of_sound=probe.sound_speed_m_per_s, attenuation=probe.attenuation_dB_per_cm_MHz
        )
        self._compiled: Callable[..., Any] | None = None

    def __call__(self, position: Floats, amplitude: Floats, delay: Floats) -> NDArray[np.float32]:
        """RF (samples, elements), the first sample at time 0."""
        import fast_simus
        import jax

        given = position[:, :2], amplitude, delay
        if self._compiled is None:
            settings = {"params": self._transducer, "medium": self._medium}
            sampling, pieces = (self._probe.sampling_MHz * MHz), 1 if self._fine else None
            # In double precision, as JAX's float32 rounds the step between frequencies, which adds up.
            self._plan = fast_simus.simus_precompute(*given, **settings, fs=sampling, element_splitting=pieces)
            settings |= {"plan": self._plan, "full_frequency_directivity": self._fine}
            self._compiled = jax.jit(partial(fast_simus.simus_compute, **settings))
        return np.asarray(self._compiled(*given).rf)

    def spectra(
        self, position: Floats, amplitude: Floats, delay: Floats, bins: NDArray[np.intp], step: float
    ) -> NDArray[np.complex128]:
        """Spectra without the pulse, as :meth:`Pymust.spectra` gives them but for a factor."""
        spectrum, fields = import_module("fast_simus.spectrum"), self._transducer
        rf, frequency = self(position, amplitude, delay), bins * step
        wave = spectrum.pulse_spectrum(2 * np.pi * frequency, fields.freq_center).conj()
        wave = wave * spectrum.probe_spectrum(2 * np.pi * frequency, fields.freq_center, fields.bandwidth) ** 2
        # Its samples are the sampling frequency apart but for what its whole number of them rounds.
        sampling = self._plan.n_fft * 2 * fields.freq_center / (self._plan.n_freq_full - 1)
        return (transform(rf.T, np.arange(len(rf)) / sampling, frequency) / wave).T


def transform(signal: NDArray[Any], time: Floats, frequency: Floats) -> NDArray[np.complex128]:
    """Sum over the last axis, samples at times (s), of signal exp(-2 pi i f t): frequencies (Hz) in place of times."""
    return signal @ np.exp(-2j * np.pi * np.outer(time, frequency))


def farthest(probe: Probe, position: Floats) -> float:
    """Greatest distance of a scatterer (n, 3) from an element, m."""
    lateral = abs(position[:, 0]) + element_centres(probe).max()
    return float(np.sqrt(lateral**2 + position[:, 1] ** 2 + position[:, 2] ** 2).max())

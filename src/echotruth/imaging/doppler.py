"""Tissue Doppler: velocity along the beam from a packet of pulses, by the 2-D autocorrelator.

Loupas, Powers, Gill 1995, IEEE Trans Ultrason Ferroelectr Freq Control 42:672. The phase by which echoes turn from
pulse to pulse is that of their autocorrelation over pulses, as of Kasai et al. 1985, IEEE Trans Sonics Ultrason 32:458;
the frequency that belongs to it is that of the echoes there, from their autocorrelation over range. In tissue it is
below the centre frequency of the probe: at low frequencies a beam is wider, and so holds more scatterers, and elements
see more of what is aside.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.imaging.beamforming.scan import Linear, Scan
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.bmode import ScanConversion

GATE_STD = 1.5
"""Standard deviation over range of the Gaussian gate over which autocorrelations are averaged, wavelengths."""

Autocorrelation = NDArray[np.complexfloating[Any, Any]]
Image = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Estimator:
    """The autocorrelator of lines.

    Attributes
    ----------
    frequency : float, Hz
        At which the lines are demodulated.
    sound_speed : float, m/s
    range_step : float, m
        Between the samples of a line.
    interval : float, s
        From one pulse to the next.
    """

    frequency: float
    sound_speed: float
    range_step: float
    interval: float

    @classmethod
    def of(cls, probe: Probe, scanner: Scanner, interval: float) -> Self:
        """The autocorrelator of the lines of a scanner."""
        step = float(scanner.range[1] - scanner.range[0])
        return cls(scanner.frequency, probe.sound_speed_m_per_s, step, interval)

    def autocorrelations(self, lines: NDArray[np.complex64]) -> tuple[Autocorrelation, Autocorrelation]:
        """Autocorrelations of the lines of a packet (pulses, lines, ranges), averaged over pulses and the gate.

        Returns
        -------
        over_pulses, over_range : ndarray of shape (lines, ranges), complex
            From one pulse to the next, and from one sample to the next.
        """
        over_pulses = np.sum(lines[:-1].conj() * lines[1:], axis=0) / (len(lines) - 1)
        over_range = np.mean(lines[..., :-1].conj() * lines[..., 1:], axis=0)
        return self._gated(over_pulses), self._gated(np.pad(over_range, ((0, 0), (0, 1)), mode="edge"))

    def velocity(self, over_pulses: Autocorrelation, over_range: Autocorrelation) -> tuple[Image, Image]:
        """Velocity towards the probe, m/s, and the Nyquist velocity c / (4 f T), of autocorrelations of one shape.

        With the local frequency f and the interval T, the phase between pulses is pi times the velocity over that of
        Nyquist, beyond which it wraps. Both are NaN where there is no echo.
        """
        frequency = self.frequency + self.sound_speed / (4 * np.pi * self.range_step) * np.angle(over_range)
        nyquist = np.where(over_pulses == 0, np.nan, self.sound_speed / (4 * frequency * self.interval))
        return nyquist * np.angle(over_pulses) / np.pi, nyquist

    def _gated(self, values: Autocorrelation) -> Autocorrelation:
        from scipy.ndimage import gaussian_filter1d  # as in bmode

        std = GATE_STD * self.sound_speed / self.frequency / self.range_step
        gated: Autocorrelation = gaussian_filter1d(values, std, axis=1, mode="nearest")
        return gated


def velocity_images(estimator: Estimator, lines: NDArray[np.complex64], convert: ScanConversion) -> tuple[Image, Image]:
    """Velocity towards the probe and Nyquist velocity, m/s, at every pixel (axial, lateral), of a packet of lines.

    Autocorrelations, which have no jump where velocities wrap, are interpolated. Outside the scan there is NaN.
    """
    images = np.full((2, *convert.inside.shape), np.nan)
    parts = [
        convert.interpolated(each.real) + 1j * convert.interpolated(each.imag)
        for each in estimator.autocorrelations(lines)
    ]
    images[:, convert.inside] = estimator.velocity(*parts)
    return images[0], images[1]


def along_beam(scan: Scan, position: Floats, vector: Floats) -> Floats:
    """Components towards the probe, (n,), of vectors (n, 2 or more) at positions (n, 2 or more); lateral, axial."""
    if isinstance(scan, Linear):
        return -vector[:, 1]
    away = position[:, :2] / np.linalg.norm(position[:, :2], axis=1, keepdims=True)
    return -np.sum(vector[:, :2] * away, axis=1)

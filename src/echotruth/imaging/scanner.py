"""The scanner: from scatterers to the focused lines of a frame."""

from __future__ import annotations

from math import hypot

import numpy as np

from echotruth.config import Bmode, Probe, Rf
from echotruth.imaging.beamform import ReceiveFocus
from echotruth.imaging.probe import apodization, element_centres
from echotruth.imaging.transmit import FocusedTransmits, line_angles


def imaging_depth(rf: Rf, bmode: Bmode) -> float:
    """Greatest range within both the sector and the square field of view, m."""
    side, half_angle = bmode.si().field_of_view, rf.si().sector / 2
    corner = np.arctan2(side / 2, side)
    return side / np.cos(half_angle) if half_angle < corner else hypot(side, side / 2)


class Scanner:
    """A probe that scans a sector line by line; delays and phases are worked out once for all frames.

    The whole frame is taken of scatterers at rest. There is no attenuation, no multiple scattering and no noise.

    Parameters
    ----------
    probe, rf
        The array, and its lines and transmit focus.
    depth
        Greatest range, m; see :func:`imaging_depth`.

    Attributes
    ----------
    angle : ndarray (lines,)
        Of the lines from the axial axis, rad; the smallest lateral coordinate first.
    range : ndarray (ranges,)
        Of the samples on a line from the centre of the array, m; a step is half a wave path of one RF sample.
    frequency : float
        Frequency to which the lines are demodulated, Hz.
    """

    def __init__(self, probe: Probe, rf: Rf, depth: float):
        p = probe.si()
        if not np.isfinite(depth) or depth < 20 * p.sound_speed / p.frequency:
            raise ValueError(f"The depth is {depth:g} m; it must be at least twenty wavelengths.")
        step = p.sound_speed / (2 * p.sampling)
        self.angle = line_angles(rf)
        self.range = step * np.arange(1, int(depth / step) + 2)
        self._transmits = FocusedTransmits(probe, rf, self.range[-1])
        self.frequency = self._transmits.frequency
        self._receive = ReceiveFocus(
            element_centres(probe),
            apodization(probe, rf.apodization),
            self.range,
            sampling=p.sampling,
            frequency=self.frequency,
            sound_speed=p.sound_speed,
        )

    def lines(self, position: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Lines of one frame.

        Parameters
        ----------
        position
            Scatterers in the frame of the probe (lateral, axial, elevation), shape (scatterers, 3), m.
        amplitude
            Their reflectivity, shape (scatterers,), 1.

        Returns
        -------
        Shape (lines, ranges), complex64, demodulated by exp(-2 pi i frequency 2 range / c): a scatterer that moves
        away by d turns the phase by -4 pi frequency d / c.
        """
        position, amplitude = checked(position, amplitude)
        lines = np.empty((len(self.angle), len(self.range)), np.complex64)
        for part, channels in self._transmits(position, amplitude):
            lines[part] = self._receive(channels, self.angle[part])
        return lines


def checked(position: np.ndarray, amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scatterers as contiguous float64 arrays, or a ValueError that says what is wrong with them."""
    position = np.ascontiguousarray(position, np.float64)
    amplitude = np.ascontiguousarray(amplitude, np.float64)
    if position.ndim != 2 or position.shape[1] != 3 or amplitude.shape != position.shape[:1]:
        raise ValueError(
            f"Scatterers need positions (n, 3) and amplitudes (n,); got {position.shape} and {amplitude.shape}."
        )
    if not len(position):
        raise ValueError("There are no scatterers to image.")
    if not (np.isfinite(position).all() and np.isfinite(amplitude).all()):
        raise ValueError("Positions and amplitudes of scatterers must be finite numbers.")
    if position[:, 1].min() <= 0:
        raise ValueError("Scatterers must lie in front of the array: their axial coordinate must be positive.")
    return position, amplitude

"""Random courses over the frames of a clip, each frame drawn from the one before."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, pi, sqrt

import numpy as np

from echotruth.arrays import Floats

Random = Callable[[str], np.random.Generator]
"""Name of what is drawn to the generator that draws it, always the same and in the same state."""


class Course:
    """A random course that may be asked for at any frame, in any order.

    Parameters
    ----------
    start : ndarray
        Value at frame 0.
    step : callable
        Value at a frame - 1 and that frame to the value there; what it draws must depend on the frame alone.
    """

    def __init__(self, start: Floats, step: Callable[[Floats, int], Floats]) -> None:
        self._start, self._step = start, step
        self._frame, self._value = 0, start

    def __call__(self, frame: int) -> Floats:
        """Value at a frame."""
        if frame < self._frame:
            self._frame, self._value = 0, self._start
        while self._frame < frame:
            self._frame += 1
            self._value = self._step(self._value, self._frame)
        return self._value


def fading(amplitude: Floats, time: Floats, constant: float, name: str, random: Random) -> Course:
    """Amplitudes that are replaced bit by bit, an autoregressive process of order one.

    a(t) = rho a(t - dt) + sqrt(1 - rho^2) e, rho = exp(-dt / constant), e normally distributed with the variance of
    the amplitudes: their variance stays and their correlation, and with it that of the RF, is exp(-dt / constant).

    Parameters
    ----------
    amplitude : ndarray of shape (n,)
        At frame 0.
    time : ndarray of shape (frame,), s
    constant : float, s
    name : str
        Of what fades: the key of its random numbers.
    random : Random

    Returns
    -------
    Course of ndarray of shape (n,)
    """
    spread = sqrt((amplitude**2).mean()) if len(amplitude) else 0.0

    def step(last: Floats, frame: int) -> Floats:
        rho = exp(-(time[frame] - time[frame - 1]) / constant)
        fresh = random(f"{name} fades {frame}").standard_normal(len(last))
        return rho * last + sqrt(1 - rho**2) * spread * fresh

    return Course(amplitude, step)


def wandering(number: int, time: Floats, constant: float, wavelength: float, random: Random) -> Course:
    """Offsets of particles that diffuse.

    The echo of one that moves by d along the beam turns by q d, q = 4 pi / wavelength. Diffusion with D lets the
    correlation of the echo of many fall as exp(-q^2 D t) (Berne & Pecora, Dynamic Light Scattering, section 5.4);
    D = 1 / (q^2 constant) makes that exp(-t / constant).

    Parameters
    ----------
    number : int
        Particles.
    time : ndarray of shape (frame,), s
    constant : float, s
    wavelength : float, m
        Of the centre frequency.
    random : Random

    Returns
    -------
    Course of ndarray of shape (n, 3), m
    """
    wavenumber = 4 * pi / wavelength

    def step(last: Floats, frame: int) -> Floats:
        spread = sqrt(2 * (time[frame] - time[frame - 1]) / constant) / wavenumber
        return last + spread * random(f"blood wanders {frame}").standard_normal(last.shape)

    return Course(np.zeros((number, 3)), step)

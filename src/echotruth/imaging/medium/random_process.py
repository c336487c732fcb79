"""Random processes over the frames of a clip, each frame drawn from the one before."""

from collections.abc import Callable
from math import exp, pi, sqrt

import numpy as np

from echotruth.arrays import Floats

Random = Callable[[str], np.random.Generator]
"""Function that returns a freshly seeded generator for a named quantity."""


class RandomProcess:
    """A Markov process over frames that can be evaluated at any frame, in any order.

    Parameters
    ----------
    start : ndarray
        Value at frame 0.
    step : callable
        Maps the value at the previous frame and the frame number to the value at that frame; its random numbers must
        depend on the frame number alone.
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


def ar1(amplitude: Floats, time: Floats, time_constant: float, name: str, random: Random) -> RandomProcess:
    """Amplitudes that decorrelate as an autoregressive process of order one.

    a(t) = rho a(t - dt) + sqrt(1 - rho^2) e, rho = exp(-dt / time_constant), with e normally distributed with the
    variance of the amplitudes. Their variance is constant; their correlation, and that of the RF, is rho.

    Parameters
    ----------
    amplitude : ndarray of shape (n,)
        At frame 0.
    time : ndarray of shape (frame,), s
    time_constant : float, s
    name : str
        Kind of scatterer: the key of its random numbers.
    random : Random

    Returns
    -------
    RandomProcess of ndarray of shape (n,)
    """
    std = sqrt((amplitude**2).mean()) if len(amplitude) else 0.0

    def step(previous: Floats, frame: int) -> Floats:
        rho = exp(-(time[frame] - time[frame - 1]) / time_constant)
        innovation = random(f"{name} fades {frame}").standard_normal(len(previous))
        return rho * previous + sqrt(1 - rho**2) * std * innovation

    return RandomProcess(amplitude, step)


def brownian(number: int, time: Floats, time_constant: float, wavelength: float, random: Random) -> RandomProcess:
    """Offsets of particles that diffuse; see :func:`diffusion_std`.

    Parameters
    ----------
    number : int
    time : ndarray of shape (frame,), s
    time_constant : float, s
    wavelength : float, m
        At the centre frequency.
    random : Random

    Returns
    -------
    RandomProcess of ndarray of shape (number, 3), m
    """

    def step(previous: Floats, frame: int) -> Floats:
        std = diffusion_std(time[frame] - time[frame - 1], time_constant, wavelength)
        return previous + std * random(f"blood wanders {frame}").standard_normal(previous.shape)

    return RandomProcess(np.zeros((number, 3)), step)


def diffusion_std(duration: float, time_constant: float, wavelength: float) -> float:
    """Standard deviation along an axis, m, of particles that diffuse for a duration, s.

    A displacement d along the beam turns the phase of the echo by q d, q = 4 pi / wavelength. The echo of many
    decorrelates as exp(-q^2 D t) (Berne & Pecora, Dynamic Light Scattering, section 5.4). D = 1 / (q^2 time_constant)
    makes that exp(-t / time_constant); the standard deviation is sqrt(2 D t).
    """
    return sqrt(2 * duration / time_constant) / (4 * pi / wavelength)

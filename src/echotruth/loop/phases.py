"""End-systole and the phases of the beat, from the curves of pressure and volume."""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

FILLING, CONTRACTION, EJECTION, RELAXATION = 0, 1, 2, 3
"""Labels of the phases: filling, isovolumic contraction, ejection, isovolumic relaxation."""

_MAX_LEAK = (0.01, 0.1)
"""Bounds of the volume, over the stroke volume, that may pass a closed valve; the noise decides between them."""

_NOISE_SDS = 4.0
"""Standard deviations of the noise that count as no change of volume."""

_NOISY_FRAMES = 32
"""With fewer frames the second differences of a curve are its own bend, of several percent, and not noise."""


def es_frame(pressure: Floats, volume: Floats) -> int:
    """Frame of end-systole, argmax P/V (time-varying elastance, Suga & Sagawa 1974).

    Parameters
    ----------
    pressure : ndarray of shape (n_frames,), Pa
    volume : ndarray of shape (n_frames,), m^3
    """
    return int(np.argmax(np.asarray(pressure) / volume))


def phases(pressure: Floats, volume: Floats) -> NDArray[np.uint8]:
    """Phase of every frame of a cycle that begins at end-diastole.

    The aortic valve opens after the last frame at end-diastolic volume before half of the stroke volume is out, the
    mitral valve after the last frame at end-systolic volume before half of it is in again. Searching back from the
    steep middle of the curve keeps noise on its flat parts from opening a valve.

    Parameters
    ----------
    pressure : ndarray of shape (n_frames,), Pa
    volume : ndarray of shape (n_frames,), m^3

    Returns
    -------
    ndarray of shape (n_frames,)
        0 filling, 1 isovolumic contraction (from end-diastole), 2 ejection (to end-systole), 3 isovolumic relaxation.
    """
    es = es_frame(pressure, volume)
    edv, esv = volume[0], np.quantile(volume, 0.05)
    margin = leak(volume, edv - esv)
    half_empty = volume < (edv + esv) / 2
    aortic = _last(volume >= edv - margin, 0, _first(half_empty, 0, es))
    mitral = _last(volume <= esv + margin, es, _first(~half_empty, es, len(volume)))
    frame = np.arange(len(volume))
    systole = np.where(frame <= aortic, CONTRACTION, np.where(frame <= es, EJECTION, RELAXATION))
    return np.where(frame <= max(mitral, es), systole, FILLING).astype(np.uint8)


def leak(volume: Floats, stroke_volume: float) -> float:
    """Change of volume, m^3, that may pass a closed valve: noise, and 1 to 10 % of the stroke volume.

    With fewer than 32 frames, noise cannot be distinguished from the bends of the curve, and it is 1 %.

    Parameters
    ----------
    volume : ndarray of shape (n_frames,), m^3
    stroke_volume : float, m^3
    """
    smallest, largest = (share * abs(stroke_volume) for share in _MAX_LEAK)
    margin = _NOISE_SDS * noise(volume) if len(volume) >= _NOISY_FRAMES else 0.0
    return float(np.clip(margin, smallest, largest))


def noise(volume: Floats) -> float:
    """Standard deviation of white noise on a periodic curve that is flat for a quarter of the time.

    sd = q_25(|V_(i-1) - 2 V_i + V_(i+1)|) / (0.319 sqrt(6)): the second differences vanish where a curve without
    noise is straight; 0.319 is that quartile for a normal deviate, and 6 the sum of the squared weights 1, -2, 1.

    Parameters
    ----------
    volume : ndarray of shape (n_frames,)
    """
    difference = np.roll(volume, 1) - 2 * volume + np.roll(volume, -1)
    return float(np.quantile(np.abs(difference), 0.25) / (0.319 * np.sqrt(6)))


def _first(condition: NDArray[np.bool_], start: int, end: int) -> int:
    """First frame from `start` up to `end` of which a condition is true; `end` if there is none."""
    frames = np.flatnonzero(condition[start:end])
    return start + int(frames[0]) if len(frames) else end


def _last(condition: NDArray[np.bool_], start: int, end: int) -> int:
    """Last frame from `start` on and before `end` of which a condition is true; `start` if there is none."""
    frames = np.flatnonzero(condition[start:end])
    return start + int(frames[-1]) if len(frames) else start

"""End-systole and the phases of the beat, found from the curves of pressure and volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

FILLING, CONTRACTION, EJECTION, RELAXATION = 0, 1, 2, 3
"""Labels of the phases: filling, isovolumic contraction, ejection, isovolumic relaxation."""

_LEAK = (0.01, 0.1)
"""Least and largest share of the stroke volume that may pass a valve that counts as closed; the noise decides."""

_NOISE = 4.0
"""Standard deviations of the noise that count as no change of volume."""


def es_frame(pressure: Floats, volume: Floats) -> int:
    """Frame of end-systole, the largest P/V (time-varying elastance, Suga & Sagawa 1974).

    Parameters
    ----------
    pressure : ndarray of shape (n_frames,), Pa
    volume : ndarray of shape (n_frames,), m^3
    """
    return int(np.argmax(np.asarray(pressure) / volume))


def phases(pressure: Floats, volume: Floats) -> NDArray[np.uint8]:
    """Phase of every frame of a cycle that begins at end-diastole.

    The aortic valve opens after the last frame, before half of the stroke volume is out, that still has the
    end-diastolic volume; the mitral valve after the last one, before half of it is in again, that still has the
    end-systolic volume. Walking back from the steep middle of the curve keeps noise on its flat parts from
    opening a valve.

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
    full, empty = volume[0], np.quantile(volume, 0.05)
    margin = np.clip(_NOISE * noise(volume), *(share * abs(full - empty) for share in _LEAK))
    out = volume < (full + empty) / 2
    aortic = _last(volume >= full - margin, 0, _first(out, 0, es))
    mitral = _last(volume <= empty + margin, es, _first(~out, es, len(volume)))
    frame = np.arange(len(volume))
    of_systole = np.where(frame <= aortic, CONTRACTION, np.where(frame <= es, EJECTION, RELAXATION))
    return np.where(frame <= max(mitral, es), of_systole, FILLING).astype(np.uint8)


def noise(volume: Floats) -> float:
    """Standard deviation of white noise on a periodic curve that is flat for a quarter of the time.

    From the lower quartile of the second differences, which vanish where a curve without noise is straight;
    0.319 is that quartile for a normal deviate, and 6 the sum of the squared weights 1, -2, 1.

    Parameters
    ----------
    volume : ndarray of shape (n_frames,)
    """
    bend = np.roll(volume, 1) - 2 * volume + np.roll(volume, -1)
    return float(np.quantile(np.abs(bend), 0.25) / (0.319 * np.sqrt(6)))


def _first(true: NDArray[np.bool_], start: int, end: int) -> int:
    """First true frame from `start` up to `end`, which stands where there is none."""
    found = np.flatnonzero(true[start:end])
    return start + int(found[0]) if len(found) else end


def _last(true: NDArray[np.bool_], start: int, end: int) -> int:
    """Last true frame from `start` on and before `end`; `start` where there is none."""
    found = np.flatnonzero(true[start:end])
    return start + int(found[-1]) if len(found) else start

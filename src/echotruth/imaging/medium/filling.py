"""Filling of the left ventricle, frame by frame: how far it is emptied, and how far its valves are open."""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.volume import cell_volumes
from echotruth.heart import Heart
from echotruth.imaging.medium.blood import Cavity

LEAST_STROKE = 1e-3
"""Change of the volume, over its mean, below which a heart does not beat and its valve stays shut."""
FULLY_OPEN = 0.6
"""Rate of filling or emptying, over its greatest, from which on a valve is fully open; by eye."""
HALF_OPEN = 0.35
"""How far the mitral valve is open in diastasis, between two waves of filling; by eye, as in a human clip."""


@lru_cache(maxsize=1)
def volumes(heart: Heart) -> Floats:
    """Volume of the cavity in every frame, (frame,), m^3."""
    cavity = Cavity(heart.endo)
    frames = range(len(heart.displacement))
    return np.array([cell_volumes(cavity.positions(heart.positions(k)), cavity.cells).sum() for k in frames])


def emptied(volume: Floats) -> Floats:
    """Ejected share of the stroke volume, (frame,): 0 at end-diastole, 1 at end-systole, from volumes (frame,), m^3."""
    stroke = volume[0] - volume.min()
    return np.clip((volume[0] - volume) / stroke, 0, 1) if _beats(volume) else np.zeros(len(volume))


def opening(volume: Floats) -> Floats:
    """How far the mitral valve is open, (frame,), 0 to 1, from volumes (frame,), m^3; the frames close a cycle.

    It follows the rate of filling, smoothly. Between the first and the last frame in which it opens it is half open
    where the cavity does not fill.
    """
    share = _opened(volume, np.roll(volume, -1) - volume)
    # A cavity may still fill after the first frame, before it empties: that is no part of diastole.
    share[: volume.argmin()] = 0
    if (filling := np.flatnonzero(share > HALF_OPEN)).size:
        diastole = slice(filling[0], filling[-1] + 1)
        share[diastole] = np.maximum(share[diastole], HALF_OPEN)
    return share


def aortic_opening(volume: Floats) -> Floats:
    """How far the aortic valve is open, (frame,), 0 to 1: as :func:`opening`, by the rate of emptying."""
    return _opened(volume, volume - np.roll(volume, -1))


def course(of_volumes: Callable[[Floats], Floats], heart: Heart, between: Sequence[float] = ()) -> Floats:
    """What follows from the volumes of a beat, such as :func:`opening`, in all frames of a heart, (frame,).

    Frames that come after those of the cycle, at fractional numbers of these, are linear between them.
    """
    cycle = len(heart.displacement) - len(between)
    starts = [] if heart.config is None else heart.config.loop.beat_starts[1:-1]
    of_frames = np.concatenate([of_volumes(beat) for beat in np.split(volumes(heart)[:cycle], starts)])
    return np.append(of_frames, np.interp(np.asarray(between), np.arange(cycle), of_frames, period=cycle))


def _opened(volume: Floats, rate: Floats) -> Floats:
    """How far a valve is open, (frame,), through which blood flows at a rate (frame,), m^3 a frame."""
    if not _beats(volume):
        return np.zeros(len(volume))
    share = np.clip(rate / (FULLY_OPEN * rate.max()), 0, 1)
    return share**2 * (3 - 2 * share)


def _beats(volume: Floats) -> bool:
    return bool(np.ptp(volume) > LEAST_STROKE * volume.mean() and volume[0] > volume.min())

"""Filling of the left ventricle, frame by frame: how far it is emptied, and how far the mitral valve is open."""

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.volume import cell_volumes
from echotruth.heart import Heart
from echotruth.imaging.medium.blood import Cavity

LEAST_STROKE = 1e-3
"""Change of the volume, over its mean, below which a heart does not beat and its valve stays shut."""
FULLY_OPEN = 0.3
"""Rate of filling, over its greatest, from which on the valve is fully open."""


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
    """How far the mitral valve is open, (frame,): 0 where the volume (frame,), m^3, does not rise to the next frame.

    It follows the rate of filling, smoothly, up to 1. The frames are a cycle that closes.
    """
    if not _beats(volume):
        return np.zeros(len(volume))
    rate = np.roll(volume, -1) - volume
    share = np.clip(rate / (FULLY_OPEN * rate.max()), 0, 1)
    return share**2 * (3 - 2 * share)


def _beats(volume: Floats) -> bool:
    return bool(np.ptp(volume) > LEAST_STROKE * volume.mean() and volume[0] > volume.min())

"""Synthetic speckle whose scatterers have a known motion."""

import numpy as np
import pytest


def make_speckle(size, motion, blur=2.5, margin=40, inside=None):
    """Log-compressed 8-bit envelope of random scatterers after a motion of lateral, axial positions in px.

    Scatterers at positions that are not `inside`, a function, are weaker by 20 dB.
    """
    random = np.random.default_rng(7)
    wide = size + 2 * margin
    position = random.uniform(-margin, size + margin, (wide**2 // 20, 2))
    weights = random.normal(size=(2, len(position))).astype(np.float32)
    if inside is not None:
        weights[:, ~inside(position)] *= 0.1
    lateral, axial = motion(position).T.astype(np.float32)
    pixel = np.arange(size, dtype=np.float32)[:, None]
    profile_x, profile_y = (np.exp(-((pixel - x) ** 2) / 2 / blur**2) for x in (lateral, axial))
    envelope = np.hypot(*(profile_y * weight @ profile_x.T for weight in weights))
    decibel = 20 * np.log10(envelope / envelope.max() + 1e-12)
    return np.clip(255 * (1 + decibel / 50), 0, 255).round().astype(np.uint8)


@pytest.fixture(scope="session")
def speckle():
    """Image of a given size after a motion."""
    return make_speckle


@pytest.fixture(scope="session")
def shifted():
    """Image of a given size after a lateral and an axial shift in px."""
    return lambda size, lateral, axial: make_speckle(size, lambda position: position + np.array([lateral, axial]))


@pytest.fixture(scope="session")
def clip():
    """Clip of square images whose motion is a function of position and frame."""
    return lambda motion, frames, size=160, **options: np.stack(
        [make_speckle(size, lambda position, t=t: motion(position, t), **options) for t in range(frames)]
    )

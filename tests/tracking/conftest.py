"""Synthetic speckle whose scatterers have a known motion."""

import numpy as np
import pytest


def make_speckle(size, motion, blur=2.5, margin=40):
    """Log-compressed 8-bit envelope of random scatterers after a motion of lateral, axial positions in px."""
    random = np.random.default_rng(7)
    wide = size + 2 * margin
    position = random.uniform(-margin, size + margin, (wide**2 // 20, 2))
    weight = random.normal(size=len(position)) + 1j * random.normal(size=len(position))
    lateral, axial = motion(position).T
    pixel = np.arange(size)[:, None]
    profile_x, profile_y = (np.exp(-((pixel - x) ** 2) / 2 / blur**2) for x in (lateral, axial))
    envelope = np.abs((profile_y * weight) @ profile_x.T)
    decibel = 20 * np.log10(envelope / envelope.max() + 1e-12)
    return np.clip(255 * (1 + decibel / 50), 0, 255).round().astype(np.uint8)


@pytest.fixture
def speckle():
    """Image of a given size after a motion."""
    return make_speckle


@pytest.fixture
def shifted():
    """Image of a given size after a lateral and an axial shift in px."""
    return lambda size, lateral, axial: make_speckle(size, lambda position: position + np.array([lateral, axial]))


@pytest.fixture
def clip():
    """Clip of square images whose motion is a function of position and frame."""
    return lambda motion, frames, size=160: np.stack(
        [make_speckle(size, lambda position, t=t: motion(position, t)) for t in range(frames)]
    )

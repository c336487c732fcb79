"""Made speckle whose scatterers move exactly as asked."""

import numpy as np
import pytest


def make_speckle(size, motion, blur=2.5, margin=40):
    """Log-compressed 8-bit envelope of random scatterers after a motion of lateral, axial positions in px."""
    random = np.random.default_rng(7)
    wide = size + 2 * margin
    place = random.uniform(-margin, size + margin, (wide**2 // 20, 2))
    weight = random.normal(size=len(place)) + 1j * random.normal(size=len(place))
    lateral, axial = motion(place).T
    pixel = np.arange(size)[:, None]
    across, down = (np.exp(-((pixel - x) ** 2) / 2 / blur**2) for x in (lateral, axial))
    envelope = np.abs((down * weight) @ across.T)
    decibel = 20 * np.log10(envelope / envelope.max() + 1e-12)
    return np.clip(255 * (1 + decibel / 50), 0, 255).round().astype(np.uint8)


@pytest.fixture
def speckle():
    """Image of a given size after a motion."""
    return make_speckle


@pytest.fixture
def shifted():
    """Image of a given size after a lateral and an axial shift in px."""
    return lambda size, lateral, axial: make_speckle(size, lambda place: place + np.array([lateral, axial]))


@pytest.fixture
def clip():
    """Clip of square images whose motion is a function of place and frame."""
    return lambda motion, frames, size=160: np.stack(
        [make_speckle(size, lambda place, t=t: motion(place, t)) for t in range(frames)]
    )

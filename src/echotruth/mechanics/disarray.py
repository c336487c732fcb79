"""Fibre disarray: a random rotation about the wall normal, smooth in space."""

import numpy as np

from echotruth.fem.tetrahedra import Floats

WAVES = 1024
"""Plane waves in the sum; the covariance is met to about 1/sqrt(WAVES)."""


def random_field(positions: Floats, length: float, seed: int) -> Floats:
    """Smooth Gaussian random field of mean 0 and standard deviation 1.

    A sum of plane waves of random direction and phase, sqrt(2 / n) sum_k cos(w_k . x + phi_k), whose covariance is
    exp(-r^2 / (2 length^2)) (random Fourier features; Rahimi & Recht, Adv Neural Inf Process Syst 20 (2007) 1177).

    Parameters
    ----------
    positions : ndarray of shape (..., 3), m
    length : float, m
        Distance at which the correlation is exp(-1/2).
    seed : int
        The same seed gives the same values at the same positions, whatever the mesh.

    Returns
    -------
    ndarray of shape (...)
    """
    random = np.random.default_rng([seed, *b"disarray"])
    wave_vectors = random.standard_normal((WAVES, 3)) / length
    phases = random.uniform(0, 2 * np.pi, WAVES)
    x, y, z = np.moveaxis(positions, -1, 0)
    total = np.zeros(x.shape)
    # One wave after the other: a matrix product would depend on the number of threads.
    for (a, b, c), phase in zip(wave_vectors, phases, strict=True):
        total += np.cos(a * x + b * y + c * z + phase)
    return np.sqrt(2 / WAVES) * total


def rotate(frames: Floats, axis: Floats, angle: Floats) -> Floats:
    """Frames rotated about an axis, counter-clockwise seen from its tip.

    Rodrigues' formula: v' = (v . a) a + cos(angle) (v - (v . a) a) + sin(angle) a x v.

    Parameters
    ----------
    frames : ndarray of shape (..., 3, 3)
        Rows f, s, n.
    axis : ndarray of shape (..., 3)
        Unit vectors.
    angle : ndarray of shape (...), rad

    Returns
    -------
    ndarray of shape (..., 3, 3)
    """
    axis, angle = axis[..., None, :], angle[..., None, None]
    along = np.sum(frames * axis, axis=-1, keepdims=True) * axis
    return along + np.cos(angle) * (frames - along) + np.sin(angle) * np.cross(axis, frames)

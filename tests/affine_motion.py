"""Affine motion of a heart, and the place of the heart in the files that hold it."""

import numpy as np

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
"""Rows: the axes of the heart in the coordinates of the files."""
SHIFT = np.array([12.0, -7.0, 30.0])
"""Origin of the heart in the coordinates of the files, mm."""
GRADIENT = np.array([[0.8, 0.05, 0.02], [-0.06, 0.85, 0.03], [0.04, -0.02, 0.9]])
"""Deformation gradient of the whole motion, in the heart frame."""
TRANSLATION = np.array([0.1, -0.2, 0.3])
"""Translation of the whole motion, in the heart frame, mm."""
FRAMES = 12


def amplitude(phase):
    """Amplitude of the motion at phases 0 to 1 of the cycle: 0 at end-diastole."""
    return np.sin(np.pi * np.asarray(phase)) ** 2


def gradient(a):
    """Deformation gradient, (3, 3), at an amplitude."""
    return np.eye(3) + a * (GRADIENT - np.eye(3))

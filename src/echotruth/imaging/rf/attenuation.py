"""Attenuation proportional to frequency, applied to the traces of all echoes at once.

In a full matrix the time of arrival gives the path, so that exp(-alpha (f - f0) c t) may be applied after the echoes
have been summed. As a function of time and frequency it is of low rank: the sum of a few products of the two.
"""

import numpy as np

from echotruth.arrays import Floats

TOLERANCE = 1e-6
"""Relative error of the sum of products."""


def separable_damping(rate: Floats, time: Floats) -> tuple[Floats, Floats]:
    """Functions of time and of frequency whose products sum to exp(-rate time).

    Parameters
    ----------
    rate : ndarray of shape (bins,), 1/s
        Of either sign.
    time : ndarray of shape (samples,), s

    Returns
    -------
    damping : ndarray of shape (rank, samples)
    filters : ndarray of shape (rank, bins)
    """
    if not rate.any():
        return np.ones((1, len(time))), np.ones((1, len(rate)))
    left, size, right = np.linalg.svd(np.exp(-np.multiply.outer(rate, time)), full_matrices=False)
    rank = int((size > TOLERANCE * size[0]).sum())
    return right[:rank], (left[:, :rank] * size[:rank]).T

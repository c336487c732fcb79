"""Directivity of an element, and how the spectra of pairs of elements follow from it.

A strip of width w in a soft baffle sends D(f) = sinc(pi w f sin(theta) / c) cos(theta) (Selfridge, Kino, Khuri-Yakub
1980, Appl Phys Lett 37:35). The pulse of a pair of elements is multiplied by D_i(f) D_j(f). Near the centre frequency
f0, D changes with frequency as (f / f0)^b, with the spectral exponent b = d ln D / d ln f = x cot(x) - 1, x being the
argument of the sinc at f0. So the product depends on b_i + b_j above all, and a little on (b_i - b_j)^2. For every
angle from the centre of the array that is fitted by polynomials.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

ANGLES = 48
"""Angles for which the spectra of all pairs are fitted, evenly spaced in their sine."""
MAX_ARGUMENT_SQUARED = 2.8**2
"""Largest x^2 that is fitted; beyond it (elements wider than 0.9 wavelengths seen steeply from the side) the
spectral exponent is that of this one."""
HALF_APERTURE = 0.25
"""Sine of the angle, to either side, of the elements for which they are fitted: an array half as wide as it is far."""
SAMPLED_ELEMENTS = 9
"""Number of element positions used in the fit."""
SERIES_TERMS = 15
STEPS = 2048
"""Steps of :func:`directivity_table`; the error of linear interpolation is 1e-7."""


def sinc_series() -> tuple[Floats, Floats]:
    """Coefficients of sin(x) / x and of its derivative in y = x^2, highest power first, each of (SERIES_TERMS,)."""
    factorial = np.cumprod(np.concatenate([[1.0], np.arange(1, 2 * SERIES_TERMS)]))
    value = (-1.0) ** np.arange(SERIES_TERMS) / factorial[1::2]
    return value[::-1].copy(), np.append(value[1:] * np.arange(1, SERIES_TERMS), 0.0)[::-1].copy()


SINC, SINC_DERIVATIVE = sinc_series()


def sinc(square: Floats) -> NDArray[Any]:
    """sin(x) / x of y = x^2 (any shape), for y up to 40; negative y gives sinh."""
    return np.polyval(SINC, square)


def spectral_exponent(square: Floats) -> Floats:
    """b = x cot(x) - 1 of y = x^2 (any shape), up to `MAX_ARGUMENT_SQUARED`: D follows f^b near f0."""
    square = np.minimum(square, MAX_ARGUMENT_SQUARED)
    return 2 * square * np.polyval(SINC_DERIVATIVE, square) / sinc(square)


def pair_spectra(
    width: float, ratio: Floats, count: int, angles: int = ANGLES, half_aperture: float = HALF_APERTURE
) -> tuple[Floats, Floats]:
    """Fit D_i(f) D_j(f) / (D_i(f0) D_j(f0)) of all pairs, for every angle from the centre of the array.

    With b_i and b_j less a mean, e = b_i + b_j and g = (b_i - b_j)^2, the fit is S_0 + S_1 e + S_2 e^2 + S_3 e^3 +
    S_4 g + S_5 g e, or the first terms of it.

    Parameters
    ----------
    width : float
        Of an element, in wavelengths of the centre frequency.
    ratio : ndarray of shape (n,)
        Frequencies over the centre frequency.
    count : int
        Terms, up to 6.
    angles : int
        Number of angles, evenly spaced in their sine from 0 on.
    half_aperture : float
        As :data:`HALF_APERTURE`.

    Returns
    -------
    mean_exponent : ndarray of shape (ANGLES,)
        Mean of b.
    spectra : ndarray of shape (ANGLES, count, n)
        S_0, S_1 and so on.
    """
    scale = (np.pi * width) ** 2
    mean_exponent, spectra = np.empty(angles), np.empty((angles, count, len(ratio)))
    i, j = np.triu_indices(SAMPLED_ELEMENTS)
    for angle, sine in enumerate(np.linspace(0, 1, angles)):
        sines = sine + half_aperture * np.cos(np.pi * (np.arange(SAMPLED_ELEMENTS) + 0.5) / SAMPLED_ELEMENTS)
        squares = np.minimum(scale * np.minimum(sines**2, 1), MAX_ARGUMENT_SQUARED)
        b = spectral_exponent(squares)
        mean_exponent[angle] = (b.min() + b.max()) / 2
        directivity = sinc(np.outer(squares, ratio**2)) / sinc(squares)[:, None]
        b -= mean_exponent[angle]
        e, g = b[i] + b[j], (b[i] - b[j]) ** 2
        terms = np.column_stack([e**0, e, e**2, e**3, g, g * e])[:, :count]
        spectra[angle] = np.linalg.lstsq(terms, directivity[i] * directivity[j], rcond=None)[0]
    return mean_exponent, spectra


def directivity_table(width: float) -> Floats:
    """Directivity without its cosine, and b, at the centre frequency over the square of the sine of the angle.

    Parameters
    ----------
    width : float
        Of an element, in wavelengths of the centre frequency.

    Returns
    -------
    ndarray of shape (STEPS + 2, 2)
        At squares of the sine from 0 to 1 in STEPS equal steps; the last row stands twice, for interpolation at 1.
    """
    squares = (np.pi * width) ** 2 * np.minimum(np.arange(STEPS + 2) / STEPS, 1)
    return np.stack([sinc(squares), spectral_exponent(squares)], axis=1)

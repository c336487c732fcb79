"""Directivity of an element: how loud and of what colour it is at an angle.

A strip of width w in a soft baffle sends D(f) = sinc(pi w f sin(theta) / c) cos(theta) (Selfridge, Kino, Khuri-Yakub
1980, Appl Phys Lett 37:35). A pair of elements hears a pulse through D_i(f) D_j(f). Near the centre frequency f0, D
changes with frequency as (f / f0)^b, b = x cot(x) - 1 with x its argument at f0, so that the product depends on
b_i + b_j, the colour of the pair, above all, and a little on (b_i - b_j)^2. For every angle from the centre of the
array that is fitted by polynomials.
"""

from __future__ import annotations

import numpy as np

from echotruth.arrays import Floats

KINDS = 48
"""Angles for which the pulses of all pairs are worked out, evenly spaced in their sine."""
WIDEST = 2.8**2
"""Greatest x^2 for which they are; beyond it (elements wider than 0.9 wavelengths seen steeply from the side) the
colour is that of this one."""
APERTURE = 0.25
"""Sine of the angle, to either side, of the elements for which they are fitted: an array half as wide as it is far."""
SPREAD = 9
"""Elements among them that are tried."""
TERMS = 15
STEPS = 2048
"""Of the table of :func:`tabulated`; interpolated linearly it errs by 1e-7."""


def sinc_series() -> tuple[Floats, Floats]:
    """Coefficients of sin(x) / x and of its derivative in y = x^2, highest power first, each of shape (TERMS,)."""
    factorial = np.cumprod(np.concatenate([[1.0], np.arange(1, 2 * TERMS)]))
    value = (-1.0) ** np.arange(TERMS) / factorial[1::2]
    return value[::-1].copy(), np.append(value[1:] * np.arange(1, TERMS), 0.0)[::-1].copy()


VALUE, SLOPE = sinc_series()


def sinc(square: Floats) -> Floats:
    """sin(x) / x of y = x^2 (any shape), for y up to 40; negative y gives sinh."""
    return np.polyval(VALUE, square)


def tilt(square: Floats) -> Floats:
    """b = x cot(x) - 1 of y = x^2 (any shape), up to `WIDEST`: power of the frequency that D follows near f0."""
    square = np.minimum(square, WIDEST)
    return 2 * square * np.polyval(SLOPE, square) / sinc(square)


def shapes(width: float, ratio: Floats, count: int) -> tuple[Floats, Floats]:
    """What the pulses of pairs are multiplied by, for every angle from the centre of the array.

    With b_i and b_j less a mean, e = b_i + b_j and g = (b_i - b_j)^2, that is a sum over the shapes times 1, e, e^2,
    e^3, g and g e, or the first of these; it is 1 at the centre frequency.

    Parameters
    ----------
    width : float
        Of an element, in wavelengths of the centre frequency.
    ratio : ndarray of shape (n,)
        Frequencies over the centre frequency.
    count : int
        Of shapes, up to 6.

    Returns
    -------
    means : ndarray of shape (KINDS,)
        Of b.
    shapes : ndarray of shape (KINDS, count, n)
    """
    scale = (np.pi * width) ** 2
    means, found = np.empty(KINDS), np.empty((KINDS, count, len(ratio)))
    one, other = np.triu_indices(SPREAD)
    for kind, sine in enumerate(np.linspace(0, 1, KINDS)):
        sines = sine + APERTURE * np.cos(np.pi * (np.arange(SPREAD) + 0.5) / SPREAD)
        squares = np.minimum(scale * np.minimum(sines**2, 1), WIDEST)
        b = tilt(squares)
        means[kind] = (b.min() + b.max()) / 2
        pulses = sinc(np.outer(squares, ratio**2)) / sinc(squares)[:, None]
        b -= means[kind]
        e, g = b[one] + b[other], (b[one] - b[other]) ** 2
        terms = np.column_stack([e**0, e, e**2, e**3, g, g * e])[:, :count]
        found[kind] = np.linalg.lstsq(terms, pulses[one] * pulses[other], rcond=None)[0]
    return means, found


def tabulated(width: float) -> Floats:
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
    return np.stack([sinc(squares), tilt(squares)], axis=1)

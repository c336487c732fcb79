"""Stress of the wall from its passive law and its pressure; the active one stands in :mod:`.active_stress`.

All tensors are in the axes of the fibre and in the order ff, ss, nn, fs, fn, sn; strains (and C)
have their tensor components, tangents act on strains with doubled shear. The numba
functions fill arrays passed to them, for one point at a time.
"""

from collections.abc import Callable
from math import sqrt

import numpy as np
from numba import njit

from echotruth.arrays import Floats
from echotruth.materials import DEFAULT, LAWS

PAIRS = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
"""Axes of each component."""

COMPONENT = np.array([(0, 3, 4), (3, 1, 5), (4, 5, 2)])
"""Component of each pair of axes."""

MULTIPLICITY = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
"""How often a component stands in a double contraction."""

_PAIRED = np.array([[COMPONENT[[p, q, p, q], [r, s, s, r]] for r, s in PAIRS] for p, q in PAIRS])
"""Components pr, qs, ps and qr for each two components pq and rs."""


REFERENCE_STRETCH = 1.1
"""Of the fibre, about that of a filled heart, at which laws are compared: hearts of different laws have the same volume
at the same pressure, so that C times this stiffness is alike, while at rest that of an exponential law is much less."""


def relative_stiffness(energy: Callable, constants: Floats) -> float:
    """Stiffness of a passive law for a C of one, over that of the default law.

    The trace of the isochoric dS/dE, which is the sum of the stiffness over all independent strains, at a uniaxial
    stretch of the fibre, l along it and 1 / sqrt(l) across.

    Parameters
    ----------
    energy : callable
        Of a module of `materials`, compiled or not.
    constants : ndarray
        Its constants.
    """
    default = LAWS[DEFAULT]
    return _stiffness(energy, constants) / _stiffness(default.energy, default.Law().constants())


def _stiffness(energy: Callable, constants: Floats) -> float:
    c = np.array([REFERENCE_STRETCH**2, 1 / REFERENCE_STRETCH, 1 / REFERENCE_STRETCH, 0.0, 0.0, 0.0])
    inverse, strain, stress, tangent = np.empty(6), np.empty(6), np.empty(6), np.empty((6, 6))
    factor = isochoric_strain(c, invert(c, inverse), strain)
    energy(strain, constants, stress, tangent)
    trace = isochoric_stress(c, inverse, factor, stress)
    isochoric_tangent(c, inverse, factor, trace, stress, tangent)
    return float(np.diag(tangent) @ MULTIPLICITY)


@njit(cache=True, error_model="numpy")
def invert(c: Floats, inverse: Floats) -> float:
    """Fill the inverse of the right Cauchy-Green tensor, both of shape (6,); returns J."""
    inverse[0] = c[1] * c[2] - c[5] * c[5]
    inverse[1] = c[0] * c[2] - c[4] * c[4]
    inverse[2] = c[0] * c[1] - c[3] * c[3]
    inverse[3] = c[4] * c[5] - c[3] * c[2]
    inverse[4] = c[3] * c[5] - c[4] * c[1]
    inverse[5] = c[3] * c[4] - c[5] * c[0]
    determinant = c[0] * inverse[0] + c[3] * inverse[3] + c[4] * inverse[4]
    for i in range(6):
        inverse[i] /= determinant
    return sqrt(determinant)


@njit(cache=True, error_model="numpy")
def isochoric_strain(c: Floats, j: float, strain: Floats) -> float:
    """Fill (J^(-2/3) C - I) / 2 for C of shape (6,); returns J^(-2/3)."""
    factor = j ** (-2.0 / 3.0)
    for i in range(6):
        strain[i] = (factor * c[i] - (1.0 if i < 3 else 0.0)) / 2
    return factor


@njit(cache=True, error_model="numpy")
def isochoric_stress(c: Floats, inverse: Floats, factor: float, stress: Floats) -> float:
    """Turn dW/dE, E the isochoric strain, into the second Piola-Kirchhoff stress, in place.

    S = J^(-2/3) Dev(dW/dE), with Dev(A) = A - (A : C) C^-1 / 3; Holzapfel, Nonlinear Solid Mechanics, eq. 6.90.
    `stress` has shape (6,); returns J^(-2/3) dW/dE : C.
    """
    normal = stress[0] * c[0] + stress[1] * c[1] + stress[2] * c[2]
    trace = normal + 2 * (stress[3] * c[3] + stress[4] * c[4] + stress[5] * c[5])
    for i in range(6):
        stress[i] = factor * (stress[i] - trace / 3 * inverse[i])
    return factor * trace


@njit(cache=True, error_model="numpy")
def isochoric_tangent(c: Floats, inverse: Floats, factor: float, trace: float, stress: Floats, tangent: Floats) -> None:
    """Turn A = d2W/dE2, E the isochoric strain, into the derivative of the stress by the strain, in place.

    Holzapfel, eq. 6.168. `stress` and `trace` are those of `isochoric_stress`; `tangent` has shape (6, 6), of
    which the upper triangle is changed.
    """
    a_c, c_a_c = np.empty(6), 0.0  # A : C and C : A : C
    for i in range(6):
        a_c[i] = 0.0
        for k in range(6):
            a_c[i] += tangent[i, k] * MULTIPLICITY[k] * c[k]
        c_a_c += MULTIPLICITY[i] * a_c[i] * c[i]
    square = factor * factor
    for i in range(6):
        for k in range(i, 6):
            value = tangent[i, k] - (a_c[i] * inverse[k] + inverse[i] * a_c[k]) / 3
            value = square * (value + c_a_c * inverse[i] * inverse[k] / 9)
            fourth = trace * (square_product(inverse, i, k) - inverse[i] * inverse[k] / 3)
            tangent[i, k] = value + 2.0 / 3.0 * (fourth - inverse[i] * stress[k] - stress[i] * inverse[k])


@njit(cache=True, error_model="numpy")
def square_product(a: Floats, i: int, k: int) -> float:
    """Entry (i, k) of the symmetrised square product (a_pr a_qs + a_ps a_qr) / 2 of a tensor of shape (6,)."""
    pr, qs, ps, qr = _PAIRED[i, k, 0], _PAIRED[i, k, 1], _PAIRED[i, k, 2], _PAIRED[i, k, 3]
    return (a[pr] * a[qs] + a[ps] * a[qr]) / 2


@njit(cache=True, error_model="numpy")
def add_volumetric(inverse: Floats, j: float, pressure: float, bulk: float, tangent: Floats) -> None:
    """Add the tangent of the stress p J C^-1 to the upper triangle of `tangent`, shape (6, 6).

    p, Pa, is positive in tension, and bulk = dp/dJ.
    """
    for i in range(6):
        for k in range(i, 6):
            outer = inverse[i] * inverse[k]
            tangent[i, k] += pressure * j * (outer - 2 * square_product(inverse, i, k)) + bulk * j * j * outer

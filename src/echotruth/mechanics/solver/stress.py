"""Stress of the wall from its passive law, its active tension and its pressure.

All tensors are in the axes of the fibre and in the order ff, ss, nn, fs, fn, sn; strains (and C)
carry their tensor components, tangents act on strains with doubled shear. The numba
functions fill arrays given to them, for one point at a time.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numba import njit

from echotruth.arrays import Floats

PAIRS = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
"""Axes of each component."""

COMPONENT = np.array([(0, 3, 4), (3, 1, 5), (4, 5, 2)])
"""Component of each pair of axes."""

SHEAR = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
"""How often a component stands in a double contraction."""

_FACTORS = np.array([[COMPONENT[[p, q, p, q], [r, s, s, r]] for r, s in PAIRS] for p, q in PAIRS])
"""Components pr, qs, ps and qr for each two components pq and rs."""


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
    scale = j ** (-2.0 / 3.0)
    for i in range(6):
        strain[i] = (scale * c[i] - (1.0 if i < 3 else 0.0)) / 2
    return scale


@njit(cache=True, error_model="numpy")
def isochoric_stress(c: Floats, inverse: Floats, scale: float, stress: Floats) -> float:
    """Turn the derivative of W by the isochoric strain into the second Piola-Kirchhoff stress.

    J^(-2/3) Dev(dW/dE), with Dev(A) = A - (A : C) C^-1 / 3; Holzapfel, Nonlinear Solid Mechanics, eq. 6.90.
    `stress`, shape (6,), is changed in its place; J^(-2/3) dW/dE : C is returned.
    """
    normal = stress[0] * c[0] + stress[1] * c[1] + stress[2] * c[2]
    trace = normal + 2 * (stress[3] * c[3] + stress[4] * c[4] + stress[5] * c[5])
    for i in range(6):
        stress[i] = scale * (stress[i] - trace / 3 * inverse[i])
    return scale * trace


@njit(cache=True, error_model="numpy")
def isochoric_tangent(c: Floats, inverse: Floats, scale: float, trace: float, stress: Floats, tangent: Floats) -> None:
    """Turn the second derivative of W by the isochoric strain into that of the stress by the strain.

    Holzapfel, eq. 6.168. `stress` and `trace` are those of `isochoric_stress`; `tangent`, shape (6, 6), is
    changed in its place, its upper triangle alone.
    """
    along, total = np.empty(6), 0.0
    for i in range(6):
        along[i] = 0.0
        for k in range(6):
            along[i] += tangent[i, k] * SHEAR[k] * c[k]
        total += SHEAR[i] * along[i] * c[i]
    square = scale * scale
    for i in range(6):
        for k in range(i, 6):
            value = tangent[i, k] - (along[i] * inverse[k] + inverse[i] * along[k]) / 3
            value = square * (value + total * inverse[i] * inverse[k] / 9)
            fourth = trace * (product(inverse, i, k) - inverse[i] * inverse[k] / 3)
            tangent[i, k] = value + 2.0 / 3.0 * (fourth - inverse[i] * stress[k] - stress[i] * inverse[k])


@njit(cache=True, error_model="numpy")
def product(a: Floats, i: int, k: int) -> float:
    """Entry (i, k) of the symmetrised square product (a_pr a_qs + a_ps a_qr) / 2 of a tensor of shape (6,)."""
    pr, qs, ps, qr = _FACTORS[i, k, 0], _FACTORS[i, k, 1], _FACTORS[i, k, 2], _FACTORS[i, k, 3]
    return (a[pr] * a[qs] + a[ps] * a[qr]) / 2


@njit(cache=True, error_model="numpy")
def add_volumetric(inverse: Floats, j: float, pressure: float, bulk: float, tangent: Floats) -> None:
    """Add the tangent of the stress p J C^-1 of a pressure (Pa, positive in tension) that itself grows by bulk per J.

    The upper triangle of `tangent`, shape (6, 6).
    """
    for i in range(6):
        for k in range(i, 6):
            outer = inverse[i] * inverse[k]
            tangent[i, k] += pressure * j * (outer - 2 * product(inverse, i, k)) + bulk * j * j * outer


@njit(cache=True, error_model="numpy")
def active(c_ff: float, beta: float, power: float) -> tuple[float, float]:
    """Active fibre stress for T_Ca = 1: S_ff = [1 + beta (lambda - 1)] / lambda^power with lambda^2 = C_ff = 2 E_f + 1.

    Power 2 is the tension per deformed area of the paper's equations 2 and 3; power 0 the tension as second
    Piola-Kirchhoff stress, as in Land et al. 2015.

    Returns
    -------
    stress, tangent : float
        S_ff and its derivative by E_f.
    """
    stretch = sqrt(c_ff)
    stress = (1 + beta * (stretch - 1)) * stretch**-power
    return stress, (beta * stretch ** (-power) - power * stress / stretch) / stretch


@njit(cache=True, error_model="numpy")
def entry(a: Floats, p: int, q: int) -> float:
    """Entry (p, q) of a symmetric tensor of shape (6,)."""
    return a[COMPONENT[p, q]]

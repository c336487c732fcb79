"""Passive and active stress of the wall, in the axes of the fibre.

All tensors are in the order ff, ss, nn, fs, fn, sn; strains (and C) carry their
tensor components, tangents act on strains with doubled shear. The numba functions
fill arrays given to them, for one point at a time.

The compiled copy of `element.respond` holds these functions within it, and Numba's
cache does not see when they change: touch element.py (or remove __pycache__) after an edit here.
"""

from __future__ import annotations

from math import exp, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PAIRS = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
"""Axes of each component."""

_SHEAR = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
"""How often a component stands in a double contraction."""


def moduli(fibre: float, transverse: float, shear: float) -> Floats:
    """Factor of the square of each strain component in Q.

    Parameters
    ----------
    fibre, transverse, shear : float
        b_f, b_t and b_fs.

    Returns
    -------
    ndarray of shape (6,)
        Q = b_f E_ff^2 + b_t (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 b_fs (E_fs^2 + E_fn^2);
        Guccione et al., J Biomech Eng 113 (1991) 42.
    """
    return np.array([fibre, transverse, transverse, shear, shear, transverse])


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
def passive(c: Floats, inverse: Floats, j: float, b: Floats, stress: Floats, tangent: Floats) -> float:
    """Isochoric stress of the exponential law for a stiffness of one.

    W = (exp Q - 1) / 2 of the isochoric strain (J^(-2/3) C - I) / 2. The split and its tangent:
    Holzapfel, Nonlinear Solid Mechanics, eqs. 6.90 and 6.168.

    Parameters
    ----------
    c, inverse : ndarray of shape (6,)
        Right Cauchy-Green tensor and its inverse.
    j : float
        Square root of its determinant.
    b : ndarray of shape (6,)
        As given by `moduli`.
    stress, tangent : ndarray of shape (6,) and (6, 6)
        Filled: second Piola-Kirchhoff stress over C, and its derivative by the Green-Lagrange strain.
        W over C is returned.
    """
    scale = j ** (-2.0 / 3.0)
    be = np.empty(6)
    q = 0.0
    for i in range(6):
        strain = (scale * c[i] - (1.0 if i < 3 else 0.0)) / 2
        be[i] = b[i] * strain
        q += _SHEAR[i] * be[i] * strain
    growth = exp(q)
    trace = 0.0
    for i in range(6):
        stress[i] = growth * be[i]
        trace += _SHEAR[i] * stress[i] * c[i]
    _isochoric_moduli(c, inverse, growth, b, be, tangent)
    for i in range(6):
        stress[i] = scale * (stress[i] - trace * inverse[i] / 3)
    for i in range(6):
        for k in range(6):
            fourth = product(inverse, i, k) - inverse[i] * inverse[k] / 3
            change = scale * trace * fourth - inverse[i] * stress[k] - stress[i] * inverse[k]
            tangent[i, k] = scale * scale * tangent[i, k] + 2.0 / 3.0 * change
    return (growth - 1) / 2


@njit(cache=True, error_model="numpy")
def _isochoric_moduli(c: Floats, inverse: Floats, growth: float, b: Floats, be: Floats, moduli: Floats) -> None:
    """Fill the derivative of exp(Q) b E by E, projected by I - C^-1 x C / 3 on both sides."""
    along, total = np.empty(6), 0.0
    for i in range(6):
        along[i] = growth * b[i] * c[i]
        for k in range(6):
            along[i] += 2 * growth * be[i] * be[k] * _SHEAR[k] * c[k]
        total += _SHEAR[i] * along[i] * c[i]
    for i in range(6):
        for k in range(6):
            value = 2 * growth * be[i] * be[k] - (along[i] * inverse[k] + inverse[i] * along[k]) / 3
            moduli[i, k] = value + total * inverse[i] * inverse[k] / 9
        moduli[i, i] += growth * b[i] / _SHEAR[i]


@njit(cache=True, error_model="numpy")
def product(a: Floats, i: int, k: int) -> float:
    """Entry (i, k) of the symmetrised square product (a_pr a_qs + a_ps a_qr) / 2 of a tensor of shape (6,)."""
    p, q = PAIRS[i, 0], PAIRS[i, 1]
    r, s = PAIRS[k, 0], PAIRS[k, 1]
    return (entry(a, p, r) * entry(a, q, s) + entry(a, p, s) * entry(a, q, r)) / 2


@njit(cache=True, error_model="numpy")
def volumetric(inverse: Floats, j: float, pressure: float, stress: Floats, tangent: Floats) -> None:
    """Stress of a pressure (Pa, positive in tension): p J C^-1.

    Fills `stress`, shape (6,), for a pressure of one; adds the derivative for the given pressure to `tangent`.
    """
    for i in range(6):
        stress[i] = j * inverse[i]
        for k in range(6):
            tangent[i, k] += pressure * j * (inverse[i] * inverse[k] - 2 * product(inverse, i, k))


@njit(cache=True, error_model="numpy")
def active(c_ff: float, beta: float) -> tuple[float, float]:
    """Active fibre stress for T_Ca = 1: S_ff = [1 + beta (lambda - 1)] / lambda^2 with lambda^2 = C_ff = 2 E_f + 1.

    Returns
    -------
    stress, tangent : float
        S_ff and its derivative by E_f; equations 2 and 3 of the paper.
    """
    stretch = sqrt(c_ff)
    stress = (1 + beta * (stretch - 1)) / c_ff
    return stress, -2 * (1 - beta) / c_ff**2 - beta / (c_ff * stretch)


@njit(cache=True, error_model="numpy")
def entry(a: Floats, p: int, q: int) -> float:
    """Entry (p, q) of a symmetric tensor of shape (6,)."""
    return a[p] if p == q else a[p + q + 2]

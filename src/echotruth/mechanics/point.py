"""Stress at one point of the wall, and its derivative by the deformation.

Parts of the stress stand in the order `PASSIVE`, `ACTIVE`, `VOLUMETRIC`, each for a factor of one, and
after them `WHOLE`, with the viscous stress; `scale` holds the factors.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from echotruth.mechanics import material

PASSIVE, ACTIVE, VOLUMETRIC, WHOLE = range(4)
"""Parts: for a stiffness, an active tension and a pressure of one, and the whole."""

COMPILED = {"cache": True, "error_model": "numpy"}
"""How the functions of an element are compiled. Nothing is contracted: code from the cache would be so otherwise."""

_COMPONENT = np.array([(0, 3, 4), (3, 1, 5), (4, 5, 2)])
"""Component of each pair of axes."""


@njit(**COMPILED)
def deform(x, slope, f, c):
    """Fill the deformation gradient (3, 3) and C (6,); returns det F, which is negative inside out."""
    for i in range(3):
        for k in range(3):
            total = 0.0
            for a in range(10):
                total += x[a, i] * slope[a, k]
            f[i, k] = total
    for k in range(6):
        p, q = material.PAIRS[k, 0], material.PAIRS[k, 1]
        c[k] = f[0, p] * f[0, q] + f[1, p] * f[1, q] + f[2, p] * f[2, q]
    return (
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )


@njit(**COMPILED)
def elastic(strain, j, law, scale, stress, tangent, with_tangent):
    """Fill the elastic parts of the stress (3, 6), each for a factor of one, and the tangent (6, 6).

    Rows of `strain`: C, which is given, its inverse and the isochoric strain.
    """
    c, inverse, isochoric = strain[0], strain[1], strain[2]
    material.invert(c, inverse)
    shrink = material.isochoric_strain(c, abs(j), isochoric)
    law.energy(isochoric, law.constants, stress[0], tangent)
    trace = material.isochoric_stress(c, inverse, shrink, stress[0])
    stress[1] = 0.0
    stress[1, 0], slope = material.active(c[0], law.active[0], law.active[1])
    for k in range(6):
        stress[2, k] = j * inverse[k]
    if with_tangent:
        material.isochoric_tangent(c, inverse, shrink, trace, stress[0], tangent)
        material.add_volumetric(inverse, j, law.local_bulk * (j - 1), law.local_bulk, tangent)
        tangent *= scale[0]
        tangent[0, 0] += scale[1] * slope
        material.add_volumetric(inverse, j, scale[2], 0.0, tangent)
        for k in range(6):
            for m in range(k):
                tangent[k, m] = tangent[m, k]
    for k in range(6):
        stress[0, k] += law.local_bulk * (j - 1) * stress[2, k]


@njit(**COMPILED)
def add_up(c, before, scale, stress, tangent):
    """Fill the whole of the stress (4, 6), what resists the growth of strain (Kelvin-Voigt) and its tangent added."""
    for k in range(6):
        viscous = scale[3] * (c[k] - before[k]) / 2
        stress[WHOLE, k] = scale[0] * stress[0, k] + scale[1] * stress[1, k] + scale[2] * stress[2, k] + viscous
        tangent[k, k] += scale[3] / material.SHEAR[k]


@njit(**COMPILED)
def first_stress(f, stress, weight, first):
    """Fill the first Piola-Kirchhoff stress, times a weight."""
    for i in range(3):
        for k in range(3):
            first[i, k] = weight * (
                f[i, 0] * material.entry(stress, 0, k)
                + f[i, 1] * material.entry(stress, 1, k)
                + f[i, 2] * material.entry(stress, 2, k)
            )


@njit(**COMPILED)
def moduli(f, stress, tangent, weight, modulus):
    """Fill dP/dF (9, 9), times a weight: F D F and the whole stress (6,) itself (Holzapfel, section 6.6)."""
    _material_moduli(f, tangent, weight, modulus)
    for k in range(3):
        for m in range(3):
            whole = weight * stress[_COMPONENT[k, m]]
            for i in range(3):
                modulus[3 * i + k, 3 * i + m] += whole


@njit(**COMPILED)
def _material_moduli(f, tangent, weight, modulus):
    half = np.empty((9, 6))
    for r in range(9):
        i, k = r // 3, r % 3
        first, second, third = _COMPONENT[0, k], _COMPONENT[1, k], _COMPONENT[2, k]
        for n in range(6):
            half[r, n] = weight * (
                f[i, 0] * tangent[first, n] + f[i, 1] * tangent[second, n] + f[i, 2] * tangent[third, n]
            )
    for r in range(9):
        for s in range(9):
            i, k = s // 3, s % 3
            modulus[r, s] = (
                f[i, 0] * half[r, _COMPONENT[0, k]]
                + f[i, 1] * half[r, _COMPONENT[1, k]]
                + f[i, 2] * half[r, _COMPONENT[2, k]]
            )

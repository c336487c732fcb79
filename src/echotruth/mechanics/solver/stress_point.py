"""Stress at one point of the wall, and its derivative by the deformation.

Parts of the stress stand in the order `PASSIVE`, `ACTIVE`, `VOLUMETRIC`, each for a factor of one, and
after them `WHOLE`, with the viscous stress; `scale` holds the factors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from echotruth.arrays import Floats
from echotruth.mechanics.solver import stress as material

PASSIVE, ACTIVE, VOLUMETRIC, WHOLE = range(4)
"""Parts: for a stiffness, an active tension and a pressure of one, and the whole."""

COMPILED = {"cache": True, "error_model": "numpy"}
"""How the functions of an element are compiled. Nothing is contracted: code from the cache would be so otherwise."""


class Point(NamedTuple):
    """Room for one point.

    Attributes
    ----------
    f : ndarray of shape (3, 3)
        Deformation gradient, from the fibre axes.
    c, inverse, strain : ndarray of shape (6,)
        Right Cauchy-Green tensor, its inverse, and the isochoric strain.
    passive : ndarray of shape (6,)
        Passive stress for a stiffness of one.
    stress : ndarray of shape (4, 6)
        Parts of the stress.
    tangent : ndarray of shape (6, 6), Pa
        Derivative of the whole stress by the strain.
    modulus : ndarray of shape (9, 9)
        dP/dF times a weight.
    """

    f: Floats
    c: Floats
    inverse: Floats
    strain: Floats
    passive: Floats
    stress: Floats
    tangent: Floats
    modulus: Floats


@njit(**COMPILED)
def room():
    """Room for one point."""
    return Point(
        np.empty((3, 3)),
        np.empty(6),
        np.empty(6),
        np.empty(6),
        np.empty(6),
        np.empty((4, 6)),
        np.empty((6, 6)),
        np.empty((9, 9)),
    )


@njit(**COMPILED)
def deform(x, slope, f, c):
    """Fill the deformation gradient (3, 3) and C (6,); returns det F, which is negative inside out."""
    for i in range(3):
        first, second, third = 0.0, 0.0, 0.0
        for a in range(10):
            first += x[a, i] * slope[a, 0]
            second += x[a, i] * slope[a, 1]
            third += x[a, i] * slope[a, 2]
        f[i, 0], f[i, 1], f[i, 2] = first, second, third
    for k in range(6):
        p, q = material.PAIRS[k, 0], material.PAIRS[k, 1]
        c[k] = f[0, p] * f[0, q] + f[1, p] * f[1, q] + f[2, p] * f[2, q]
    return (
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )


@njit(**COMPILED)
def respond(j, law, scale, before, at, with_tangent):
    """Fill the parts of the stress and its tangent of a point whose C and J are known.

    Elastic parts, each for a factor of one, and what resists the growth of strain since `before`, a C (6,) too
    (Kelvin-Voigt).
    """
    stiffness, tension, pressure, viscosity = scale
    c, inverse, passive, stress, tangent = at.c, at.inverse, at.passive, at.stress, at.tangent
    material.invert(c, inverse)
    shrink = material.isochoric_strain(c, abs(j), at.strain)
    law.energy(at.strain, law.constants, passive, tangent)
    trace = material.isochoric_stress(c, inverse, shrink, passive)
    active, slope = material.active(c[0], law.active[0], law.active[1])
    bulk = stiffness * law.local_bulk
    swelling = bulk * (j - 1) + pressure
    for k in range(6):
        stress[WHOLE, k] = stiffness * passive[k] + swelling * j * inverse[k] + viscosity * (c[k] - before[k]) / 2
    stress[WHOLE, 0] += tension * active
    if with_tangent:
        material.isochoric_tangent(c, inverse, shrink, trace, passive, tangent)
        tangent *= stiffness
        material.add_volumetric(inverse, j, swelling, bulk, tangent)
        tangent[0, 0] += tension * slope
        for k in range(6):
            tangent[k, k] += viscosity / material.SHEAR[k]
            for m in range(k):
                tangent[k, m] = tangent[m, k]
            stress[PASSIVE, k] = passive[k] + law.local_bulk * (j - 1) * j * inverse[k]
            stress[ACTIVE, k] = active if k == 0 else 0.0
            stress[VOLUMETRIC, k] = j * inverse[k]


@njit(**COMPILED)
def add_force(at, slope, weight, force, start):
    """Add the parts of the force (4, 30) from `start` on: the first Piola-Kirchhoff stress along the slopes (10, 3)."""
    f, stress = at.f, at.stress
    for part in range(start, 4):
        ff, ss, nn = stress[part, 0], stress[part, 1], stress[part, 2]
        fs, fn, sn = stress[part, 3], stress[part, 4], stress[part, 5]
        for i in range(3):
            first = weight * (f[i, 0] * ff + f[i, 1] * fs + f[i, 2] * fn)
            second = weight * (f[i, 0] * fs + f[i, 1] * ss + f[i, 2] * sn)
            third = weight * (f[i, 0] * fn + f[i, 1] * sn + f[i, 2] * nn)
            for a in range(10):
                force[part, 3 * a + i] += first * slope[a, 0] + second * slope[a, 1] + third * slope[a, 2]


@njit(**COMPILED)
def moduli(at, weight):
    """Fill dP/dF, times a weight: F D F and the whole stress itself (Holzapfel, section 6.6)."""
    f, tangent, modulus = at.f, at.tangent, at.modulus
    half = np.empty((9, 6))
    for r in range(9):
        i, k = r // 3, r % 3
        first, second, third = material.COMPONENT[0, k], material.COMPONENT[1, k], material.COMPONENT[2, k]
        for n in range(6):
            half[r, n] = weight * (
                f[i, 0] * tangent[first, n] + f[i, 1] * tangent[second, n] + f[i, 2] * tangent[third, n]
            )
    for r in range(9):
        for s in range(9):
            i, k = s // 3, s % 3
            modulus[r, s] = (
                f[i, 0] * half[r, material.COMPONENT[0, k]]
                + f[i, 1] * half[r, material.COMPONENT[1, k]]
                + f[i, 2] * half[r, material.COMPONENT[2, k]]
            )
    for k in range(3):
        for m in range(3):
            whole = weight * at.stress[WHOLE, material.COMPONENT[k, m]]
            for i in range(3):
                modulus[3 * i + k, 3 * i + m] += whole

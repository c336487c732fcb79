"""Stress at one point of the wall, and its derivative by the deformation.

Parts of the stress stand in the order `PASSIVE`, `ACTIVE`, `VOLUMETRIC`, each for a factor of one, and
after them `TOTAL`, with the viscous stress and that of taut scars; `scale` holds the factors C, T_Ca and p, one over
the time since the previous state, 1/s, and the stiffness of a taut scar.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from echotruth.arrays import Floats
from echotruth.mechanics.solver import stress as laws
from echotruth.mechanics.solver.active_stress import active_stress, deformed_area

PASSIVE, ACTIVE, VOLUMETRIC, TOTAL = range(4)
"""Parts: for a stiffness, an active tension and a pressure of one, and the total."""

COMPILED: dict[str, Any] = {"cache": True, "error_model": "numpy", "forceinline": True}
"""Options of the compiled functions. No contraction to FMA: code from the cache would be contracted differently.
Inlined, because a call counts the references to each array passed to it, which takes as long as the arithmetic."""


class Point(NamedTuple):
    """Work arrays of one point.

    Attributes
    ----------
    f : ndarray of shape (3, 3)
        Deformation gradient, from the fibre axes.
    c, inverse, strain : ndarray of shape (6,)
        Right Cauchy-Green tensor, its inverse, and the isochoric strain.
    passive : ndarray of shape (6,)
        Passive stress for a stiffness of one.
    active_stiffness : ndarray of shape (3,)
        Derivative of the active stress along f, s and n by the strain there, for a tension of one.
    stress : ndarray of shape (4, 6)
        Parts of the second Piola-Kirchhoff stress S.
    dS_dE : ndarray of shape (6, 6), Pa
        Derivative of the total S by the strain.
    dP_dF : ndarray of shape (9, 9)
        Derivative of the first Piola-Kirchhoff stress P = F S, times a weight; rows and columns are pairs (axis,
        material axis).
    """

    f: Floats
    c: Floats
    inverse: Floats
    strain: Floats
    passive: Floats
    active_stiffness: Floats
    stress: Floats
    dS_dE: Floats
    dP_dF: Floats


@njit(**COMPILED)
def allocate():
    """Uninitialized work arrays."""
    return Point(
        np.empty((3, 3)),
        np.empty(6),
        np.empty(6),
        np.empty(6),
        np.empty(6),
        np.empty(3),
        np.empty((4, 6)),
        np.empty((6, 6)),
        np.empty((9, 9)),
    )


@njit(**COMPILED)
def deform(x, dN_dX, f, c):
    """Fill F_iJ = sum_a x_ai dN_a/dX_J and C = F^T F, (6,); returns J = det F, which is negative inside out."""
    for i in range(3):
        first, second, third = 0.0, 0.0, 0.0
        for a in range(10):
            first += x[a, i] * dN_dX[a, 0]
            second += x[a, i] * dN_dX[a, 1]
            third += x[a, i] * dN_dX[a, 2]
        f[i, 0], f[i, 1], f[i, 2] = first, second, third
    for k in range(6):
        p, q = laws.PAIRS[k, 0], laws.PAIRS[k, 1]
        c[k] = f[0, p] * f[0, q] + f[1, p] * f[1, q] + f[2, p] * f[2, q]
    return (
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )


@njit(**COMPILED)
def evaluate(j, law, scale, previous_c, taut_c, work, with_tangent):
    """Fill the parts of the stress and its tangent of a point whose C and J are known.

    S = C S_passive + T_Ca S_active + (p + C pointwise_bulk_ratio (J - 1)) J C^-1
    + viscosity (C - C_previous) / (2 time since) + taut stiffness (C - C_ED) / 2; the last term but one is viscous
    (Kelvin-Voigt), with the growth of C since the previous state, the last one that of a scar. S_active acts along the
    fibre, and by its shares along sheet and normal: the tension of fibres that are dispersed into these directions, as
    in Walker et al. (Am J Physiol 289 (2005) H692). Across the fibre it is a tension per deformed area that follows
    neither the stretch nor the velocity there: a share that grew with the stretch along the normal would hold the
    length of a heart whose wall thickens back, and leave it to a weak heart. A tension below zero is left over from a
    solution and not of muscle: it does not fall with the velocity.
    """
    stiffness, tension, pressure, rate, taut = scale
    viscous_modulus = law.viscosity * rate
    c, inverse, passive, stress, tangent = work.c, work.inverse, work.passive, work.stress, work.dS_dE
    active_stiffness = work.active_stiffness
    laws.invert(c, inverse)
    factor = laws.isochoric_strain(c, abs(j), work.strain)
    law.energy(work.strain, law.constants, passive, tangent)
    trace = laws.isochoric_stress(c, inverse, factor, passive)
    bulk = stiffness * law.pointwise_bulk_ratio
    hydrostatic = bulk * (j - 1) + pressure
    for k in range(6):
        viscous = (viscous_modulus * (c[k] - previous_c[k]) + taut * (c[k] - taut_c[k])) / 2
        stress[TOTAL, k] = stiffness * passive[k] + hydrostatic * j * inverse[k] + viscous
    active, active_tangent = active_stress(c[0], previous_c[0], rate if tension > 0 else 0.0, law.active)
    for k in range(3):
        if k > 0:
            active, active_tangent = deformed_area(c[k], law.active)
            active, active_tangent = law.cross_fibre[k - 1] * active, law.cross_fibre[k - 1] * active_tangent
        stress[TOTAL, k] += tension * active
        stress[ACTIVE, k], stress[ACTIVE, k + 3] = active, 0.0
        active_stiffness[k] = active_tangent
    if with_tangent:
        laws.isochoric_tangent(c, inverse, factor, trace, passive, tangent)
        tangent *= stiffness
        laws.add_volumetric(inverse, j, hydrostatic, bulk, tangent)
        for k in range(3):
            tangent[k, k] += tension * active_stiffness[k]
        for k in range(6):
            tangent[k, k] += (viscous_modulus + taut) / laws.MULTIPLICITY[k]
            for m in range(k):
                tangent[k, m] = tangent[m, k]
            stress[PASSIVE, k] = passive[k] + law.pointwise_bulk_ratio * (j - 1) * j * inverse[k]
            stress[VOLUMETRIC, k] = j * inverse[k]


@njit(**COMPILED)
def add_force(work, dN_dX, weight, force, start):
    """Add weight P_iJ dN_a/dX_J, P = F S, to the parts of the nodal force (4, 30) from `start` on."""
    f, stress = work.f, work.stress
    for part in range(start, 4):
        ff, ss, nn = stress[part, 0], stress[part, 1], stress[part, 2]
        fs, fn, sn = stress[part, 3], stress[part, 4], stress[part, 5]
        for i in range(3):
            first = weight * (f[i, 0] * ff + f[i, 1] * fs + f[i, 2] * fn)
            second = weight * (f[i, 0] * fs + f[i, 1] * ss + f[i, 2] * sn)
            third = weight * (f[i, 0] * fn + f[i, 1] * sn + f[i, 2] * nn)
            for a in range(10):
                force[part, 3 * a + i] += first * dN_dX[a, 0] + second * dN_dX[a, 1] + third * dN_dX[a, 2]


@njit(**COMPILED)
def linearize(work, weight):
    """Fill weight dP_iJ/dF_kL, with dP_iJ/dF_kL = F_iM dS_MJ/dE_NL F_kN + delta_ik S_JL (Holzapfel, section 6.6)."""
    f, tangent, dP_dF = work.f, work.dS_dE, work.dP_dF
    dP_dE = np.empty((9, 6))
    for r in range(9):
        i, k = r // 3, r % 3
        first, second, third = laws.COMPONENT[0, k], laws.COMPONENT[1, k], laws.COMPONENT[2, k]
        for n in range(6):
            dP_dE[r, n] = weight * (
                f[i, 0] * tangent[first, n] + f[i, 1] * tangent[second, n] + f[i, 2] * tangent[third, n]
            )
    for r in range(9):
        for s in range(9):
            i, k = s // 3, s % 3
            dP_dF[r, s] = (
                f[i, 0] * dP_dE[r, laws.COMPONENT[0, k]]
                + f[i, 1] * dP_dE[r, laws.COMPONENT[1, k]]
                + f[i, 2] * dP_dE[r, laws.COMPONENT[2, k]]
            )
    for k in range(3):
        for m in range(3):
            total = weight * work.stress[TOTAL, laws.COMPONENT[k, m]]
            for i in range(3):
                dP_dF[3 * i + k, 3 * i + m] += total

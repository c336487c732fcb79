"""The exponential law of an orthotropic wall."""

from __future__ import annotations

from math import exp
from typing import Literal

import numpy as np

from echotruth.materials.material import Material
from echotruth.section import Positive


class Law(Material):
    """W = C/2 (exp Q - 1), Q = fibre E_ff^2 + sheet E_ss^2 + normal E_nn^2 + 2 fibre_sheet E_fs^2
    + 2 fibre_normal E_fn^2 + 2 sheet_normal E_sn^2."""

    law: Literal["guccione"] = "guccione"
    """The exponential law with six free moduli; that of Guccione 1991, `fung` here, is its transversely isotropic case.
    The defaults are of Usyk et al., J Elast 61 (2000) 143, for the dog, with C = 0.88 kPa."""
    fibre: Positive = 5.0
    """b_ff."""
    sheet: Positive = 6.0
    """b_ss."""
    normal: Positive = 3.0
    """b_nn."""
    fibre_sheet: Positive = 10.0
    """b_fs."""
    fibre_normal: Positive = 2.0
    """b_fn."""
    sheet_normal: Positive = 2.0
    """b_sn."""

    def constants(self) -> np.ndarray:
        """The factor of the square of each strain component in Q."""
        along = (self.fibre, self.sheet, self.normal)
        return np.array([*along, self.fibre_sheet, self.fibre_normal, self.sheet_normal])


def energy(e, b, stress, tangent):
    """W / C of the isochoric strain e; fills stress (6,) and tangent (6, 6)."""
    q = 0.0
    for i in range(6):
        stress[i] = b[i] * e[i]
        q += stress[i] * e[i] * (1 if i < 3 else 2)
    growth = exp(q)
    for i in range(6):
        for k in range(6):
            tangent[i, k] = 2 * growth * stress[i] * stress[k]
        tangent[i, i] += growth * b[i] / (1 if i < 3 else 2)
    for i in range(6):
        stress[i] *= growth
    return (growth - 1) / 2

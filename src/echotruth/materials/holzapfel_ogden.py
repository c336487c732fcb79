"""The structural law of an orthotropic wall: a matrix, fibres, sheets, and the shear between the two."""

from math import exp
from typing import Literal

import numpy as np

from echotruth.materials.material import Material
from echotruth.section import Positive


class Law(Material):
    """W = a/(2 b) (exp[b (I1 - 3)] - 1) + a_f/(2 b_f) (exp[b_f (I4f - 1)^2] - 1) + the same for the sheet
    + a_fs/(2 b_fs) (exp[b_fs I8fs^2] - 1), of the invariants of the isochoric right Cauchy-Green tensor; fibre and
    sheet bear only tension. C is a."""

    law: Literal["holzapfel_ogden"] = "holzapfel_ogden"
    """Holzapfel & Ogden, Phil Trans R Soc A 367 (2009) 3445; the defaults are its fit to the shear of pig hearts."""
    exponent: Positive = 8.023
    """b."""
    fibre: Positive = 313.1
    """a_f / a, of a = 0.059 and a_f = 18.472 kPa."""
    fibre_exponent: Positive = 16.026
    """b_f."""
    sheet: Positive = 42.05
    """a_s / a, a_s = 2.481 kPa."""
    sheet_exponent: Positive = 11.120
    """b_s."""
    fibre_sheet: Positive = 3.661
    """a_fs / a, a_fs = 0.216 kPa."""
    fibre_sheet_exponent: Positive = 11.436
    """b_fs."""

    def constants(self) -> np.ndarray:
        """b, then modulus and exponent of fibre, sheet and their shear."""
        fibre, sheet = (self.fibre, self.fibre_exponent), (self.sheet, self.sheet_exponent)
        return np.array([self.exponent, *fibre, *sheet, self.fibre_sheet, self.fibre_sheet_exponent])


def energy(e, b, stress, tangent):
    """W / C of the isochoric strain e; fills stress (6,) and tangent (6, 6)."""
    # I1 - 3 = 2 tr e, I4 - 1 = 2 e_ff or 2 e_ss, I8fs = 2 e_fs.
    exponential = exp(2 * b[0] * (e[0] + e[1] + e[2]))
    energy = (exponential - 1) / (2 * b[0])
    tangent[:] = 0.0
    for i in range(3):
        stress[i], stress[3 + i] = exponential, 0.0
        for k in range(3):
            tangent[i, k] = 2 * b[0] * exponential
    for i, at in ((0, 1), (1, 3), (3, 5)):
        if e[i] <= 0 and i < 3:
            continue
        # A shear component stands twice in a double contraction, so half of the derivative is its stress.
        modulus, exponent, half = b[at], 4 * b[at + 1] * e[i] * e[i], (1.0 if i < 3 else 0.5)
        exponential = exp(exponent)
        energy += modulus * (exponential - 1) / (2 * b[at + 1])
        stress[i] += 4 * half * modulus * e[i] * exponential
        tangent[i, i] += 4 * half * half * modulus * (1 + 2 * exponent) * exponential
    return energy

"""The paper's transversely isotropic law with an exponential of Fung's type."""

from math import exp
from typing import Literal

import numpy as np

from echotruth.materials.material import Material
from echotruth.section import Positive


class Law(Material):
    """W = C/2 (exp Q - 1), Q = fibre E_ff^2 + transverse (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 shear (E_fs^2 + E_fn^2)."""

    law: Literal["fung"] = "fung"
    """The paper's law: Guccione et al., J Biomech Eng 113 (1991) 42."""
    fibre: Positive = 9.2
    """b_f (Omens 1993)."""
    transverse: Positive = 2.0
    """b_t."""
    shear: Positive = 3.7
    """b_fs."""

    def constants(self) -> np.ndarray:
        """b_f, b_t, b_t, b_fs, b_fs, b_t: the coefficient of the square of each strain component in Q."""
        b_f, b_t, b_fs = self.fibre, self.transverse, self.shear
        return np.array([b_f, b_t, b_t, b_fs, b_fs, b_t])


def energy(e, b, stress, tangent):
    """W / C = (exp Q - 1) / 2, Q = sum_i m_i b_i e_i^2, of the isochoric strain e; fills stress (6,), tangent (6, 6).

    m_i is 1 of a normal strain and 2 of a shear, S_i = exp(Q) b_i e_i and the tangent
    exp(Q) (2 b_i e_i b_k e_k + b_i delta_ik / m_i).
    """
    q = 0.0
    for i in range(6):
        stress[i] = b[i] * e[i]
        q += stress[i] * e[i] * (1 if i < 3 else 2)
    exp_q = exp(q)
    for i in range(6):
        for k in range(6):
            tangent[i, k] = 2 * exp_q * stress[i] * stress[k]
        tangent[i, i] += exp_q * b[i] / (1 if i < 3 else 2)
    for i in range(6):
        stress[i] *= exp_q
    return (exp_q - 1) / 2

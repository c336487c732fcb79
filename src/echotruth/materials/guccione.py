"""The exponential law of an orthotropic wall, with six moduli; the law of Guccione 1991 is `fung`."""

from typing import Literal

import numpy as np

from echotruth.materials.fung import energy
from echotruth.materials.material import Material
from echotruth.section import Positive

__all__ = ["Law", "energy"]


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
        """The coefficient of the square of each strain component in Q."""
        normal = (self.fibre, self.sheet, self.normal)
        return np.array([*normal, self.fibre_sheet, self.fibre_normal, self.sheet_normal])

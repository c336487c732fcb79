"""The isotropic law of rubber."""

from typing import Literal

import numpy as np

from echotruth.materials.material import Material


class Law(Material):
    """W = C/2 (I1 - 3), of the first invariant of the isochoric right Cauchy-Green tensor."""

    law: Literal["neo_hooke"] = "neo_hooke"
    """The simplest law, C the shear modulus: Treloar, Trans Faraday Soc 39 (1943) 36."""

    def constants(self) -> np.ndarray:
        """None."""
        return np.empty(0)


def energy(e, _, stress, tangent):
    """W / C of the isochoric strain e; fills stress (6,) and tangent (6, 6)."""
    # I1 - 3 is twice the trace of the strain.
    tangent[:] = 0.0
    for i in range(6):
        stress[i] = 1.0 if i < 3 else 0.0
    return e[0] + e[1] + e[2]

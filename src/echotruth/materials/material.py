"""Base class of the passive laws."""

import numpy as np

from echotruth.section import Positive, Section
from echotruth.units import kPa


class Material(Section):
    """A passive law: its energy is the stiffness C times a function of the isochoric strain."""

    stiffness_kPa: Positive | None = None
    """C. Default: solved, so that the heart has its end-diastolic volume at its end-diastolic pressure; of a heart
    with a scar, without it, so that healthy tissue stays what it was and the scar makes the heart stiffer. When given,
    or with a scar, the loop's volumes are scaled to the volume the heart then has at end-diastolic pressure."""

    @property
    def stiffness(self) -> float | None:
        """C, Pa; None if it is solved."""
        return None if self.stiffness_kPa is None else self.stiffness_kPa * kPa

    def constants(self) -> np.ndarray:
        """Numbers of the law, C left out, in the order in which its `energy` takes them."""
        raise NotImplementedError

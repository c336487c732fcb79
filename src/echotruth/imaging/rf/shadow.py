"""Acoustic shadow: a rib that blocks the way between some elements and some scatterers.

The rib lies across the plane of the image at one depth, from its edge outwards. The straight ray from an element to a
scatterer passes or is blocked, there and back; sound is not bent round the edge. Seen from a scatterer behind the rib,
the edge projects to one position on the array, and the elements beyond are blocked. So each way between an element and
a scatterer is multiplied by a transmission.
"""

from math import pi, tan

import numpy as np

from echotruth.arrays import Floats
from echotruth.config.realism import Shadow
from echotruth.units import deg, mm

MIN_EDGE_WIDTH = 1e-9
"""Width of a sharp edge, m."""


class Rib:
    """A rib before the array.

    Parameters
    ----------
    shadow : Shadow
        Where it is.

    Attributes
    ----------
    depth : float
        m.
    """

    def __init__(self, shadow: Shadow) -> None:
        self.depth = shadow.depth_mm * mm
        self._side = 1 if shadow.side == "right" else -1
        self._edge = self.depth * tan(shadow.edge_deg * deg)
        self._edge_width = max(shadow.edge_width_mm * mm, MIN_EDGE_WIDTH)
        self._floor = np.float32(10 ** (shadow.level_dB / 20))

    def projected_edge(self, position: Floats) -> Floats:
        """Project the edge of the rib from scatterers on the array.

        Parameters
        ----------
        position : ndarray of shape (scatterers, 3), m

        Returns
        -------
        ndarray of shape (scatterers,), m
            Towards the side of the rib; elements farther to that side are blocked. Infinite for scatterers before the
            rib.
        """
        lateral, ratio = self._side * position[:, 0], self.depth / position[:, 1]
        behind = ratio < 1
        ratio = np.where(behind, ratio, 0)
        return np.where(behind, (self._edge - lateral * ratio) / (1 - ratio), np.inf)

    def transmission(self, position: Floats, centres: Floats) -> np.ndarray:
        """Amplitude that passes between scatterers at `position` (n, 3), m, and elements, one way.

        The lateral coordinates of the elements are `centres` (elements,), m. Shape (n, elements), float32.
        """
        past = self.projected_edge(position)[:, None] - self._side * centres
        free = np.clip(past / self._edge_width + 0.5, 0, 1).astype(np.float32)
        # A quarter of a sine, squared, is a ramp with round ends.
        return self._floor + (1 - self._floor) * np.sin(np.float32(pi / 2) * free) ** 2

"""Acoustic shadow: a rib that blocks the way between some elements and some scatterers.

The rib lies across the plane of the image at one depth, from its edge outwards. The straight ray from an element to a
scatterer passes or is blocked, there and back; sound is not bent round the edge. Seen from a scatterer behind the rib,
the edge projects to one position on the array, and the elements beyond are blocked. So scatterers are taken in strips
of nearly the same projection, and in the full matrix of a strip the rows and columns of blocked elements are faint.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, tan

import numpy as np

from echotruth.config.realism import Shadow

STRIPS = 32
"""Strips over the length of the array."""


class Rib:
    """A rib before the array.

    Parameters
    ----------
    shadow
        Where it is.
    centres
        Lateral coordinates of the elements, shape (elements,), m.
    """

    def __init__(self, shadow: Shadow, centres: np.ndarray):
        s = shadow.si()
        self._side = 1 if shadow.side == "right" else -1
        self._depth, self._edge_width, self._floor = s.depth, max(s.edge_width, 1e-9), 10 ** (shadow.level_dB / 20)
        self._edge = s.depth * tan(s.edge)
        self._centres = self._side * centres
        last = (np.ptp(centres) + self._edge_width) / 2
        self._projections = np.linspace(-last, last, STRIPS + 1)

    def projected_edge(self, position: np.ndarray) -> np.ndarray:
        """Project the edge of the rib from scatterers on the array.

        Parameters
        ----------
        position
            Shape (scatterers, 3), m.

        Returns
        -------
        Shape (scatterers,), m, towards the side of the rib; elements farther to that side are blocked. Infinite for
        scatterers before the rib.
        """
        lateral, ratio = self._side * position[:, 0], self._depth / position[:, 1]
        behind = ratio < 1
        ratio = np.where(behind, ratio, 0)
        return np.where(behind, (self._edge - lateral * ratio) / (1 - ratio), np.inf)

    def transmission(self, projection: float) -> np.ndarray:
        """Amplitude that passes to or from the elements for one projected edge (m): shape (elements,), float32."""
        free = np.clip((projection - self._centres) / self._edge_width + 0.5, 0, 1)
        # A quarter of a sine, squared, is a ramp with round ends.
        return (self._floor + (1 - self._floor) * np.sin(pi / 2 * free) ** 2).astype(np.float32)

    def strips(self, position: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Scatterers (n, 3), m, strip by strip: their indices, and what passes to the elements, (elements,)."""
        middles = (self._projections[1:] + self._projections[:-1]) / 2
        nearest = np.searchsorted(middles, self.projected_edge(position))
        order = np.argsort(nearest, kind="stable")
        ends = np.searchsorted(nearest[order], np.arange(len(self._projections) + 1))
        for strip, projection in enumerate(self._projections):
            if ends[strip] < ends[strip + 1]:
                yield order[ends[strip] : ends[strip + 1]], self.transmission(projection)

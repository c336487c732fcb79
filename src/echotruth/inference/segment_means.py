"""Contractility and stiffness of AHA segments as means over their muscle, relative to the whole wall.

A common factor of the contractility of all segments changes no motion, because the active tension is that which gives
the loop; nor does one of their stiffness, since C is that which fills the heart. Motion determines the ratio of a
segment to the wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.aha import segment
from echotruth.arrays import Floats
from echotruth.config import Config, Pathology
from echotruth.config.regional import Regional
from echotruth.fem.tetrahedra import Integers
from echotruth.fem.volume import cell_volumes
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.pathology import tissue
from echotruth.mechanics.solver.wall import wall

SEGMENTS = range(1, 18)


@dataclass(frozen=True)
class SegmentMeans:
    """Means over the muscle of segments of factors that are given at their middles.

    Attributes
    ----------
    weights : ndarray of shape (n, 17)
        Mean over each segment of a factor that is 1 at the middle of another and 0 at the others.
    volume : ndarray of shape (n,), m^3
        Of the unloaded muscle of the segments.
    number : ndarray of shape (n,)
        AHA segments; those in which a coarse mesh has a cell.
    """

    weights: Floats
    volume: Floats
    number: Integers

    @classmethod
    def of(cls, config: Config) -> SegmentMeans:
        """Means of the wall of a configuration."""
        body = wall(config, left_ventricle(config.geometry))
        nodes, cells = body.mesh.nodes, body.mesh.cells
        number = segment(nodes[cells[:, :4]].mean(axis=1), float(nodes[body.mesh.endo, 2].min()))
        columns = []
        for one in SEGMENTS:
            factors = tissue(body.mesh, body.depth, Pathology(), Regional(preset="even", contractility={one: 2.0}))
            means, volume = means_of_cells(nodes, cells, number, factors.tension_scale - 1.0)
            columns.append(means)
        shown = np.flatnonzero(volume)
        return cls(np.stack(columns, axis=1)[shown], volume[shown], (shown + 1).astype(np.int32))

    @property
    def share(self) -> Floats:
        """Share of each segment in the muscle of the wall, (n,)."""
        return self.volume / self.volume.sum()

    def means(self, factors: Floats) -> Floats:
        """Means over segments (draws, n) of factors (draws, 17) at their middles."""
        return factors @ self.weights.T


def means_of_cells(nodes: Floats, cells: Integers, segments: Integers, values: Floats) -> tuple[Floats, Floats]:
    """Means (17,) over the muscle of AHA segments of values of cells (n_cells,), and its volumes (17,), m^3.

    NaN, and 0, of a segment in which a coarse mesh has no cell.
    """
    volume = cell_volumes(nodes, cells)
    total, sums = (
        np.bincount(segments, weight, minlength=len(SEGMENTS) + 1)[1:].astype(float)
        for weight in (volume, volume * values)
    )
    return np.divide(sums, total, out=np.full(len(total), np.nan), where=total > 0), total

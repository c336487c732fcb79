"""The beating heart as imaging and evaluation use it: a mesh, its labels and its motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config

SHORT_AXIS = np.array([[-1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]])
"""Rows: lateral, axial and elevation axis of all short-axis views, in the heart frame."""


def in_right_wall(wall_depth: Floats, cells: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Whether cells (n_cells, 10) belong to the free wall of a right ventricle, through which the wall depth (n_nodes,)
    goes from 1 to 2; (n_cells,)."""
    return wall_depth[cells].max(axis=1) > 1


@dataclass(frozen=True)
class RigidMotion:
    """Rigid motion of a heart relative to a probe: x goes to c + R (x - c) + d.

    Attributes
    ----------
    centre : ndarray of shape (3,), m
        c, the middle of the array.
    rotation : ndarray of shape (frame, 3, 3)
        R; none in frame 0.
    shift : ndarray of shape (frame, 3), m
        d; none in frame 0.
    """

    centre: Floats
    rotation: Floats
    shift: Floats

    def displacement(self, frame: int, positions: Floats) -> Floats:
        """Displacement in a frame of what would be at positions (n, 3), m, without this motion; (n, 3), m."""
        return (positions - self.centre) @ (self.rotation[frame] - np.eye(3)).T + self.shift[frame]

    def undone(self, frame: int, positions: Floats) -> Floats:
        """Where what is at positions (n, 3), m, in a frame would be without this motion; (n, 3), m."""
        return (positions - self.centre - self.shift[frame]) @ self.rotation[frame] + self.centre


@dataclass(frozen=True, eq=False)
class Heart:
    """A beating heart: a mesh and its displacement in every frame.

    Attributes
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
        Unloaded.
    cells : ndarray of shape (n_cells, 10)
    displacement : ndarray of shape (frame, n_nodes, 3), m
        From unloaded; frame 0 is end-diastole.
    wall_depth : ndarray of shape (n_nodes,)
        Above 1 in the free wall of a right ventricle.
    endo : ndarray of shape (n_facets, 6)
        Nodes of the endocardial triangles.
    layers : int
        Number of transmural layers.
    es : int
        Frame of end-systole.
    region : ndarray of shape (n_cells,), uint8, optional
        Region of disease of each cell: 0 healthy, 1 infarct, 2 border zone, 3 late activation.
    rigid : RigidMotion, optional
        Motion relative to a probe, which the displacement has on top of that of the heart.
    config : Config, optional
        The configuration it was made by.
    arrays : dict of dict of ndarray
        All that was computed of it, by the groups of docs/schema.md.

    Examples
    --------
    >>> import echotruth as et
    >>> heart = et.Repository("out/demo").heart()
    >>> heart.positions(heart.es).shape == heart.nodes.shape  # nodes at end-systole, m
    True
    """

    nodes: Floats
    cells: NDArray[np.int32]
    displacement: Floats
    wall_depth: Floats
    endo: NDArray[np.int32]
    layers: int
    es: int
    region: NDArray[np.uint8] | None = None
    rigid: RigidMotion | None = field(default=None, repr=False)
    config: Config | None = field(default=None, repr=False)
    arrays: dict[str, dict[str, NDArray]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, arrays: dict[str, dict[str, NDArray]], config: Config) -> Heart:
        """Make the heart from its groups `geometry`, `fibres`, `pathology` and `mechanics` (docs/schema.md)."""
        geometry, mechanics = arrays["geometry"], arrays["mechanics"]
        return cls(
            nodes=geometry["node_position"],
            cells=geometry["cell_node"],
            displacement=mechanics["displacement"],
            wall_depth=arrays["fibres"]["wall_depth"],
            endo=geometry["endo"],
            layers=config.fibres.layers,
            es=int(mechanics["es_frame"]),
            region=arrays["pathology"]["region"],
            config=config,
            arrays=arrays,
        )

    @cached_property
    def right_wall(self) -> NDArray[np.bool_]:
        """Cells of the free wall of a right ventricle, (n_cells,): tissue without truth of its own."""
        return in_right_wall(self.wall_depth, self.cells)

    @property
    def apex(self) -> float:
        """z of the unloaded endocardial apex, m."""
        return float(self.nodes[self.endo.ravel(), 2].min())

    @property
    def endo_at_ed(self) -> Floats:
        """Endocardial nodes at end-diastole, (n, 3), m; those of several triangles several times."""
        return self.positions(0)[self.endo.ravel()]

    def positions(self, frame: int) -> Floats:
        """Nodes in a frame, (n_nodes, 3), m."""
        return self.nodes + self.displacement[frame]

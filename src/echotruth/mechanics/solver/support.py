"""Support of the heart: which displacements of its base are free."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import Mesh


@dataclass(frozen=True)
class Support:
    """Which displacements are free, and along which directions.

    Attributes
    ----------
    directions : ndarray of shape (n_nodes, 3, 3)
        Rows: directions of the three displacements of each node.
    free : ndarray of shape (n_nodes, 3), bool
    prescribed : ndarray of shape (n_nodes, 3), m, or None
        Displacement of every node to which that of the solution is added.
    """

    directions: Floats
    free: NDArray[np.bool_]
    prescribed: Floats | None = None


def base_support(mesh: Mesh, base: Literal["radial_free", "fixed", "elastic"]) -> Support:
    """Support of a heart at its base.

    Parameters
    ----------
    mesh : Mesh
    base : "radial_free", "fixed" or "elastic"
        Nodes of the base move only along the radius from the long axis, not at all, or freely: springs then hold them.
    """
    directions = np.tile(np.eye(3), (len(mesh.nodes), 1, 1))
    nodes = np.unique(mesh.base)
    x, y, _ = (mesh.nodes[nodes] / np.linalg.norm(mesh.nodes[nodes, :2], axis=1, keepdims=True)).T
    directions[nodes, 0, :2] = np.column_stack([x, y])
    directions[nodes, 1, :2] = np.column_stack([-y, x])
    free = np.ones((len(mesh.nodes), 3), dtype=bool)
    free[nodes] = [base != "fixed", base == "elastic", base == "elastic"]
    return Support(directions, free)

"""Support of the heart: its base, and the springs of its surroundings.

The stiffness of the springs enters residual and tangent in :mod:`.equilibrium`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import Mesh
from echotruth.mechanics.solver.cavity import triangle_shape


@dataclass(frozen=True)
class Support:
    """Which displacements are free, and along which directions.

    Attributes
    ----------
    directions : ndarray of shape (n_nodes, 3, 3)
        Rows: directions of the three displacements of each node.
    free : ndarray of shape (n_nodes, 3), bool
    spring : float, Pa/m
        Stiffness per area against motion of the epicardium along its unloaded normal.
    prescribed : ndarray of shape (n_nodes, 3), m, or None
        Displacement of every node to which that of the solution is added.
    """

    directions: Floats
    free: NDArray[np.bool_]
    spring: float = 0.0
    prescribed: Floats | None = None


def base_support(mesh: Mesh, base: Literal["radial_free", "fixed"], spring: float = 0.0) -> Support:
    """Support of a heart at its base.

    Parameters
    ----------
    mesh : Mesh
    base : "radial_free" or "fixed"
        Nodes of the base move only along the radius from the long axis, or not at all.
    spring : float, Pa/m
    """
    directions = np.tile(np.eye(3), (len(mesh.nodes), 1, 1))
    nodes = np.unique(mesh.base)
    x, y, _ = (mesh.nodes[nodes] / np.linalg.norm(mesh.nodes[nodes, :2], axis=1, keepdims=True)).T
    directions[nodes, 0, :2] = np.column_stack([x, y])
    directions[nodes, 1, :2] = np.column_stack([-y, x])
    free = np.ones((len(mesh.nodes), 3), dtype=bool)
    free[nodes] = [base == "radial_free", False, False]
    return Support(directions, free, spring)


def spring_stiffness(mesh: Mesh, stiffness: float) -> Floats:
    """Stiffness matrices of springs along the unloaded normals of the epicardium: int k (N_a n) (N_b n)^T dA.

    Parameters
    ----------
    mesh : Mesh
    stiffness : float, Pa/m
        k.

    Returns
    -------
    ndarray of shape (n_facets, 18, 18), N/m
        Rows and columns run over node and axis.
    """
    xi, weight = triangle()
    value, dN_dxi = triangle_shape(xi)
    first, second = (np.einsum("qa,fai->fqi", dN_dxi[..., k], mesh.nodes[mesh.epi]) for k in (0, 1))
    area = np.cross(first, second)
    normal = area / np.linalg.norm(area, axis=-1, keepdims=True)
    normal_shape = np.einsum("qa,fqi->fqai", value, normal).reshape(*normal.shape[:2], 18)
    measure = stiffness * weight * np.linalg.norm(area, axis=-1)
    return np.einsum("fqr,fqs,fq->frs", normal_shape, normal_shape, measure)

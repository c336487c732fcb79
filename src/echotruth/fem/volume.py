"""Volume of quadratic tetrahedra."""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Integers, shape_gradient


def jacobians(nodes: Floats, cells: Integers) -> NDArray[np.float64]:
    """Determinant of dX/dxi, the volume of tissue per volume of local coordinates, at the quadrature points.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 10)

    Returns
    -------
    ndarray of shape (n_cells, 14), m^3
    """
    return np.linalg.det(np.einsum("cai,qaj->cqij", nodes[cells], shape_gradient(tetrahedron()[0])))


def cell_volumes(nodes: Floats, cells: Integers) -> Floats:
    """Volume of each tetrahedron, the integral of det dX/dxi.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 10)

    Returns
    -------
    ndarray of shape (n_cells,), m^3
    """
    return np.einsum("cq,q->c", jacobians(nodes, cells), tetrahedron()[1])

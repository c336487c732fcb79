"""Volume of quadratic tetrahedra."""

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Integers, shape_gradient
from echotruth.fem.vectorised import triple_product


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
    dN_dxi = np.swapaxes(shape_gradient(tetrahedron()[0]), 0, 1)
    # One product of matrices a cell, and no LAPACK: both are slow on matrices as small as those of a point.
    dx_dxi = np.swapaxes(nodes[cells], 1, 2) @ dN_dxi.reshape(len(dN_dxi), -1)
    return triple_product(*np.moveaxis(dx_dxi.reshape(len(cells), 3, -1, 3), (1, 3), (0, 1)))


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

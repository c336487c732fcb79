"""Volume of the cavity, and the load of the blood on the endocardium.

V = -1/3 int x . n da over the endocardium, whose normals n point into the cavity; the lid lies in the plane of the
base, z = 0, through the origin, and adds nothing. With the derivatives x,1 and x,2 of the position x by the local
coordinates, x . n da = det(x, x,1, x,2) dxi, which quadrature on quadratic triangles integrates exactly. The pressure P
is work-conjugate to V: its nodal forces, which follow the wall, are P dV/dx, and their tangent P d2V/dx2 is symmetric.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from echotruth.arrays import Floats
from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import Integers

_EDGES = np.array([(0, 1), (1, 2), (2, 0)])


def triangle_shape(xi: Floats) -> tuple[Floats, Floats]:
    """Quadratic shape functions of a triangle.

    Parameters
    ----------
    xi : ndarray of shape (n, 2)

    Returns
    -------
    value : ndarray of shape (n, 6)
    dN_dxi : ndarray of shape (n, 6, 2)
        Zienkiewicz & Taylor, The Finite Element Method, vol. 1, section 6.
    """
    corner = np.column_stack([1 - xi.sum(axis=1), xi])
    dcorner_dxi = np.vstack([-np.ones(2), np.eye(2)])
    a, b = _EDGES.T
    value = np.hstack([corner * (2 * corner - 1), 4 * corner[:, a] * corner[:, b]])
    middle = 4 * (corner[:, a, None] * dcorner_dxi[b] + corner[:, b, None] * dcorner_dxi[a])
    return value, np.concatenate([(4 * corner[..., None] - 1) * dcorner_dxi, middle], axis=1)


_XI, _WEIGHT = triangle()
_N, _DN_DXI = triangle_shape(_XI)
_OPERATORS = np.stack([_N, _DN_DXI[..., 0], _DN_DXI[..., 1]])
"""Nodes to x, x,1 and x,2 at the quadrature points, (3, n_points, 6)."""


def cavity_volume(nodes: Floats, endo: Integers) -> float:
    """Volume between the endocardium and the plane of the base.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
        Of the deformed wall; the rim of the cavity lies in z = 0.
    endo : ndarray of shape (n_facets, 6)

    Returns
    -------
    float, m^3
    """
    x = nodes[endo]
    position = np.einsum("qa,fai->fqi", _N, x)
    first, second = (np.einsum("qa,fai->fqi", _DN_DXI[..., k], x) for k in (0, 1))
    flux = np.sum(position * np.cross(first, second), axis=-1)
    return -float(np.sum(np.einsum("fq,q->f", flux, _WEIGHT))) / 3


def volume_gradient(nodes: Floats, endo: Integers) -> Floats:
    """dV/dx, facet by facet: the nodal forces of a unit pressure.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    endo : ndarray of shape (n_facets, 6)

    Returns
    -------
    ndarray of shape (n_facets, 6, 3), m^2
    """
    columns = (_OPERATORS.reshape(-1, 6) @ nodes[endo]).reshape(len(endo), 3, -1, 3)
    cofactors = np.cross(columns[:, [1, 2, 0]], columns[:, [2, 0, 1]]).reshape(len(endo), -1, 3)
    return (-_WEIGHT[:, None] / 3 * _OPERATORS).reshape(-1, 6).T @ cofactors


@njit(cache=True, error_model="numpy")
def volume_hessian(nodes: Floats, endo: Integers, hessian: Floats) -> None:
    """d2V/dx2, facet by facet.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    endo : ndarray of shape (n_facets, 6)
    hessian : ndarray of shape (n_facets, 18, 18), m
        Filled. Rows and columns run over node and axis.
    """
    for f in range(endo.shape[0]):
        _facet_hessian(nodes, endo[f], hessian[f])


@njit(cache=True, error_model="numpy")
def _facet_hessian(nodes: Floats, facet: Integers, hessian: Floats) -> None:
    """Sum over the points of the second derivatives of -weight / 3 det(x, x,1, x,2)."""
    hessian[:] = 0.0
    columns, axis = np.empty((3, 3)), np.empty(3)
    for q in range(_WEIGHT.shape[0]):
        operators = _OPERATORS[:, q]
        columns[:] = 0.0
        for a in range(6):
            for s in range(3):
                for i in range(3):
                    columns[s, i] += operators[s, a] * nodes[facet[a], i]
        for a in range(6):
            for b in range(6):
                _hessian_axis(operators[:, a], operators[:, b], columns, -_WEIGHT[q] / 3, axis)
                _add_cross(axis, hessian[3 * a : 3 * a + 3, 3 * b : 3 * b + 3])


@njit(cache=True, error_model="numpy")
def _hessian_axis(a: Floats, b: Floats, columns: Floats, weight: float, axis: Floats) -> None:
    """Fill the vector (3,) such that the second derivative by two nodes, moved by u and v, is det(u, v, axis)."""
    axis[:] = 0.0
    for s in range(3):
        p, q = (s + 1) % 3, (s + 2) % 3
        factor = weight * (a[p] * b[q] - a[q] * b[p])
        for i in range(3):
            axis[i] += factor * columns[s, i]


@njit(cache=True, error_model="numpy")
def _add_cross(axis: Floats, block: Floats) -> None:
    block[0, 1] += axis[2]
    block[1, 0] -= axis[2]
    block[1, 2] += axis[0]
    block[2, 1] -= axis[0]
    block[2, 0] += axis[1]
    block[0, 2] -= axis[1]

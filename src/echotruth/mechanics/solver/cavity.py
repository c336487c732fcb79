"""Volume of the cavity, and the load of the blood on the endocardium.

The volume is a third of the flux of the position through the endocardium; the lid
lies in the plane of the base, z = 0, through the origin, and adds nothing. On
quadratic triangles the integral is exact, its gradient is the force of a unit
pressure that follows the wall, and its Hessian is symmetric.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import Floats, Integers

_EDGES = np.array([(0, 1), (1, 2), (2, 0)])


def triangle_shape(xi: Floats) -> tuple[Floats, Floats]:
    """Quadratic shape functions of a triangle.

    Parameters
    ----------
    xi : ndarray of shape (n, 2)

    Returns
    -------
    value : ndarray of shape (n, 6)
    slope : ndarray of shape (n, 6, 2)
        Zienkiewicz & Taylor, The Finite Element Method, vol. 1, section 6.
    """
    corner = np.column_stack([1 - xi.sum(axis=1), xi])
    step = np.vstack([-np.ones(2), np.eye(2)])
    a, b = _EDGES.T
    value = np.hstack([corner * (2 * corner - 1), 4 * corner[:, a] * corner[:, b]])
    middle = 4 * (corner[:, a, None] * step[b] + corner[:, b, None] * step[a])
    return value, np.concatenate([(4 * corner[..., None] - 1) * step, middle], axis=1)


_XI, _WEIGHT = triangle()
_VALUE, _SLOPE = triangle_shape(_XI)
_FACTORS = np.stack([_VALUE, _SLOPE[..., 0], _SLOPE[..., 1]])
"""What the position and its two derivatives are of the nodes, (3, n_points, 6): the volume is their determinant."""


def cavity_volume(nodes: NDArray[np.float64], endo: Integers) -> float:
    """Volume between the endocardium and the plane of the base.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
        Of the deformed wall; the rim of the cavity lies in z = 0.
    endo : ndarray of shape (n_facets, 6)

    Returns
    -------
    float, m^3
        Minus a third of the flux of the position, as the facets' normals point into the cavity.
    """
    x = nodes[endo]
    position = np.einsum("qa,fai->fqi", _VALUE, x)
    first, second = (np.einsum("qa,fai->fqi", _SLOPE[..., k], x) for k in (0, 1))
    flux = np.sum(position * np.cross(first, second), axis=-1)
    return -float(np.sum(np.einsum("fq,q->f", flux, _WEIGHT))) / 3


def load(nodes: Floats, endo: Integers) -> Floats:
    """First derivatives of the volume of the cavity, facet by facet: the force of a unit pressure.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    endo : ndarray of shape (n_facets, 6)

    Returns
    -------
    ndarray of shape (n_facets, 6, 3), m^2
    """
    slots = (_FACTORS.reshape(-1, 6) @ nodes[endo]).reshape(len(endo), 3, -1, 3)
    others = np.cross(slots[:, [1, 2, 0]], slots[:, [2, 0, 1]]).reshape(len(endo), -1, 3)
    return (-_WEIGHT[:, None] / 3 * _FACTORS).reshape(-1, 6).T @ others


@njit(cache=True, error_model="numpy")
def stiffness(nodes: Floats, endo: Integers, hessian: Floats) -> None:
    """Second derivatives of the volume of the cavity, facet by facet.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    endo : ndarray of shape (n_facets, 6)
    hessian : ndarray of shape (n_facets, 18, 18), m
        Filled. Rows and columns run over node and axis.
    """
    for f in range(endo.shape[0]):
        _facet(nodes, endo[f], hessian[f])


@njit(cache=True, error_model="numpy")
def _facet(nodes: Floats, facet: Integers, hessian: Floats) -> None:
    """Sum over the points of the second derivatives of weight * det(position, first, second)."""
    hessian[:] = 0.0
    slots, factors, axis = np.empty((3, 3)), np.empty((6, 3)), np.empty(3)
    for q in range(_WEIGHT.shape[0]):
        factors[:, 0], factors[:, 1:] = _VALUE[q], _SLOPE[q]
        slots[:] = 0.0
        for a in range(6):
            for s in range(3):
                for i in range(3):
                    slots[s, i] += factors[a, s] * nodes[facet[a], i]
        for a in range(6):
            for b in range(6):
                _axis(factors[a], factors[b], slots, -_WEIGHT[q] / 3, axis)
                _add_cross(axis, hessian[3 * a : 3 * a + 3, 3 * b : 3 * b + 3])


@njit(cache=True, error_model="numpy")
def _axis(a: Floats, b: Floats, slots: Floats, weight: float, axis: Floats) -> None:
    """Fill the vector (3,) of the second derivatives by two nodes, which are u, v -> det(u, v, axis)."""
    axis[:] = 0.0
    for s in range(3):
        p, q = (s + 1) % 3, (s + 2) % 3
        factor = weight * (a[p] * b[q] - a[q] * b[p])
        for i in range(3):
            axis[i] += factor * slots[s, i]


@njit(cache=True, error_model="numpy")
def _add_cross(axis: Floats, block: Floats) -> None:
    block[0, 1] += axis[2]
    block[1, 0] -= axis[2]
    block[1, 2] += axis[0]
    block[2, 1] -= axis[0]
    block[2, 0] += axis[1]
    block[0, 2] -= axis[1]

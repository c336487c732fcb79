"""Volume of the cavity, and the load of the blood on the endocardium.

V = -1/3 int x . n da over the endocardium, whose normals n point into the cavity; the lid lies in the plane of the
base, z = 0, through the origin, and adds nothing. With the derivatives x,1 and x,2 of the position x by the local
coordinates, x . n da = det(x, x,1, x,2) dxi, which quadrature on quadratic triangles integrates exactly. The pressure P
is work-conjugate to V: its nodal forces, which follow the wall, are P dV/dx, and their tangent P d2V/dx2 is symmetric.
"""

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import Integers, shape, shape_gradient

_XI, _WEIGHT = triangle()
_N, _DN_DXI = shape(_XI), shape_gradient(_XI)
_OPERATORS = np.stack([_N, _DN_DXI[..., 0], _DN_DXI[..., 1]])
"""Nodes to x, x,1 and x,2 at the quadrature points, (3, n_points, 6)."""
_NEXT, _LAST = np.roll(_OPERATORS, -1, axis=0), np.roll(_OPERATORS, -2, axis=0)
_MINORS = (
    -_WEIGHT[:, None, None] / 3 * (_NEXT[..., None] * _LAST[..., None, :] - _LAST[..., None] * _NEXT[..., None, :])
)
"""M_s = -weight / 3 (O_pa O_qb - O_qa O_pb) of the operators O, with s, p, q in turn, by point and nodes a and b, (3,
n_points, 6, 6)."""
_PERMUTATION = np.cross(np.eye(3)[:, None], np.eye(3))
"""Levi-Civita symbol, (3, 3, 3)."""


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
    columns = (_OPERATORS.reshape(-1, 6) @ nodes[endo]).reshape(len(endo), 3, len(_WEIGHT), 3)
    cofactors = np.cross(columns[:, [1, 2, 0]], columns[:, [2, 0, 1]]).reshape(len(endo), 3 * len(_WEIGHT), 3)
    return (-_WEIGHT[:, None] / 3 * _OPERATORS).reshape(-1, 6).T @ cofactors


def volume_hessian(nodes: Floats, endo: Integers) -> Floats:
    """d2V/dx2 (n_facets, 18, 18), m, facet by facet, at nodes (n_nodes, 3), m; rows and columns run over node and axis.

    The second derivative by two nodes a and b, moved by u and v, is det(u, v, c_ab), c_ab = sum_s M_s,ab x_s summed
    over the points: x_s is x, x,1 and x,2, and M_s stands with `_MINORS`.
    """
    x = np.ascontiguousarray(nodes[endo].transpose(1, 2, 0))
    # Sums term by term: those of a matrix product depend on its library.
    columns = sum(_OPERATORS[:, :, a, None, None] * x[a] for a in range(6))
    terms = (_MINORS[:, q, ..., None, None] * columns[:, q, None, None] for q in range(len(_WEIGHT)))
    c = sum(first + second + third for first, second, third in terms)
    return np.einsum("ijk,abkf->faibj", _PERMUTATION, c).reshape(len(endo), 18, 18)

"""Quadrature rules on the reference tetrahedron and triangle, with positive weights, from scikit-fem."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@cache
def tetrahedron() -> tuple[Floats, Floats]:
    """Fourteen points, exact to degree 5.

    Returns
    -------
    xi : ndarray of shape (14, 3)
        Local coordinates.
    weight : ndarray of shape (14,)
        They add up to 1/6, the volume of the reference tetrahedron.
    """
    from skfem.refdom import RefTet

    return _rule(RefTet, 5)


@cache
def triangle() -> tuple[Floats, Floats]:
    """Six points, exact to degree 4.

    Returns
    -------
    xi : ndarray of shape (6, 2)
        Local coordinates.
    weight : ndarray of shape (6,)
        They add up to 1/2, the area of the reference triangle.
    """
    from skfem.refdom import RefTri

    return _rule(RefTri, 4)


def _rule(domain: type, degree: int) -> tuple[Floats, Floats]:
    from skfem.quadrature import get_quadrature

    xi, weight = get_quadrature(domain, degree)
    return np.ascontiguousarray(xi.T), np.ascontiguousarray(weight)

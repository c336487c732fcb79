"""Quadrature rules on the reference tetrahedron and triangle, with positive weights."""

from itertools import permutations

import numpy as np

from echotruth.arrays import Floats

# Barycentric coordinates of one point of each orbit, and its weight as a fraction of the volume or area.
_TETRAHEDRON: dict[tuple[float, ...], float] = {
    (0.0673422422100981705, 0.3108859192633006098, 0.3108859192633006098, 0.3108859192633006098): 0.1126879257180158508,
    (0.7217942490673263208, 0.0927352503108912264, 0.0927352503108912264, 0.0927352503108912264): 0.0734930431163619495,
    (0.4544962958743503505, 0.4544962958743503505, 0.0455037041256496495, 0.0455037041256496495): 0.0425460207770814664,
}
_TRIANGLE: dict[tuple[float, ...], float] = {
    (0.1081030181680702273, 0.4459484909159648863, 0.4459484909159648863): 0.2233815896780114657,
    (0.8168475729804585131, 0.0915762135097707435, 0.0915762135097707435): 0.1099517436553218676,
}


def tetrahedron() -> tuple[Floats, Floats]:
    """Fourteen points, exact to degree 5.

    Returns
    -------
    xi : ndarray of shape (14, 3)
        Local coordinates.
    weight : ndarray of shape (14,)
        They add up to 1/6, the volume of the reference tetrahedron.
        Walkington, Quadrature on simplices of arbitrary dimension (2000).
    """
    xi, weight = _points(_TETRAHEDRON)
    return xi, weight / 6


def triangle() -> tuple[Floats, Floats]:
    """Six points, exact to degree 4.

    Returns
    -------
    xi : ndarray of shape (6, 2)
        Local coordinates.
    weight : ndarray of shape (6,)
        They add up to 1/2, the area of the reference triangle.
        Dunavant, Int J Numer Meth Eng 21 (1985) 1129.
    """
    xi, weight = _points(_TRIANGLE)
    return xi, weight / 2


def _points(orbits: dict[tuple[float, ...], float]) -> tuple[Floats, Floats]:
    rows = [(point, weight) for corner, weight in orbits.items() for point in sorted(set(permutations(corner)))]
    xi = np.array([point[1:] for point, _ in rows])
    weight = np.array([weight for _, weight in rows])
    return xi, weight / weight.sum()

"""Straight lines through a surface: where they meet it."""

from __future__ import annotations

import numpy as np

from echotruth.fem.tetrahedra import Floats, Integers

SAME = 1e-6
"""Distance below which two meetings are one, over the size of the surface."""


class Rays:
    """A surface of triangles that lines are shot at.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    triangles : ndarray of shape (n, 3)
    """

    def __init__(self, nodes: Floats, triangles: Integers) -> None:
        import pyvista
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkFiltersGeneral import vtkOBBTree

        # VTK's tolerances are absolute and made for sizes about one.
        self._size = float(np.ptp(nodes, axis=0).max())
        self._surface = pyvista.PolyData.from_regular_faces(nodes / self._size, triangles[:, :3])
        self._tree, self._points = vtkOBBTree(), vtkPoints()
        self._tree.SetDataSet(self._surface)
        self._tree.BuildLocator()

    def meetings(self, start: Floats, direction: Floats) -> list[Floats]:
        """Distances along each line at which it meets the surface, rising.

        Parameters
        ----------
        start, direction : ndarray of shape (n, 3), m and of length one

        Returns
        -------
        list of n ndarray of shape (n_meetings,), m
        """
        return [self._along(a, d) for a, d in zip(start / self._size, direction, strict=True)]

    def _along(self, start: Floats, direction: Floats) -> Floats:
        self._tree.IntersectWithLine(start, start + 4 * direction, self._points, None)
        hits = np.array([self._points.GetPoint(i) for i in range(self._points.GetNumberOfPoints())])
        along = np.sort((hits.reshape(-1, 3) - start) @ direction)
        # A line through an edge meets both of its triangles.
        return along[np.diff(along, prepend=-np.inf) > SAME] * self._size

    def distances(self, points: Floats) -> Floats:
        """Distances of points (n, 3), m, from the surface, shape (n,), m."""
        _, nearest = self._surface.find_closest_cell(points / self._size, return_closest_point=True)
        return np.linalg.norm(points - nearest * self._size, axis=1)


def all_round(n: int) -> Floats:
    """Directions evenly over the sphere, shape (n, 3): Fibonacci's lattice (Gonzalez, Math Geosci 42 (2010) 49)."""
    k = np.arange(n) + 0.5
    z = 1 - 2 * k / n
    azimuth = np.pi * (3 - np.sqrt(5)) * k
    across = np.sqrt(1 - z**2)
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), z])

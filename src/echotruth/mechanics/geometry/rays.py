"""Intersections of straight lines with a triangulated surface."""

from typing import Any

import numpy as np

from echotruth.fem.tetrahedra import Floats, Integers

MERGE_DISTANCE = 1e-6
"""Distance below which two intersections are one, over the size of the surface."""

EDGE_TOLERANCE = 1e-9
"""Distance from a triangle at which a ray still meets it, over the size of the surface: rounding lets a ray through an
edge pass between its triangles."""


class Rays:
    """Rays through a surface of triangles.

    Parameters
    ----------
    nodes : ndarray of shape (n_nodes, 3), m
    triangles : ndarray of shape (n, 3)
    """

    def __init__(self, nodes: Floats, triangles: Integers) -> None:
        import pyvista
        from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

        # VTK's tolerances are absolute and made for sizes about one.
        self._size = float(np.ptp(nodes, axis=0).max())
        corners: Any = triangles[:, :3]  # any integers do, but the annotation asks for int64
        self._surface = pyvista.PolyData.from_regular_faces(nodes / self._size, corners)
        self._locator, self._points, self._triangles = vtkStaticCellLocator(), vtkPoints(), vtkIdList()
        self._locator.SetDataSet(self._surface)
        self._locator.BuildLocator()

    def intersections(self, start: Floats, direction: Floats) -> list[Floats]:
        """Distances along each ray at which it meets the surface, rising.

        Parameters
        ----------
        start, direction : ndarray of shape (n, 3), m and of length one

        Returns
        -------
        list of n ndarray of shape (n_intersections,), m
        """
        return [self._distances_along(a, d) for a, d in zip(start / self._size, direction, strict=True)]

    def _distances_along(self, start: Floats, direction: Floats) -> Floats:
        ends: tuple[Any, Any] = start, start + 4 * direction  # arrays do, but the annotation asks for sequences
        self._locator.IntersectWithLine(*ends, EDGE_TOLERANCE, self._points, self._triangles)
        hits = [self._points.GetPoint(i) for i in range(self._points.GetNumberOfPoints())]
        if not hits:
            return np.empty(0)
        distances, is_new = np.sort((np.array(hits) - start) @ direction), np.ones(len(hits), dtype=bool)
        # A ray through an edge meets both of its triangles.
        is_new[1:] = distances[1:] - distances[:-1] > MERGE_DISTANCE
        return distances[is_new] * self._size

    def distances(self, points: Floats) -> Floats:
        """Distances of points (n, 3), m, from the surface, shape (n,), m."""
        _, nearest = self._surface.find_closest_cell(points / self._size, return_closest_point=True)
        return np.linalg.norm(points - nearest * self._size, axis=1)


def sphere_directions(n: int) -> Floats:
    """Unit vectors evenly over the sphere, shape (n, 3): Fibonacci's lattice (Gonzalez, Math Geosci 42 (2010) 49)."""
    k = np.arange(n) + 0.5
    z = 1 - 2 * k / n
    azimuth = np.pi * (3 - np.sqrt(5)) * k
    radius = np.sqrt(1 - z**2)
    return np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z])

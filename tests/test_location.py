"""The finding of points is the inverse of interpolation."""

import numpy as np

from echotruth.config import Phantom
from echotruth.imaging.phantom import seed
from echotruth.location import locate
from echotruth.tetrahedra import MaterialPoints, interpolate


def _bent(nodes):
    """A strongly nonuniform motion, so that all cells are curved."""
    return nodes * [1.1, 0.9, 1.05] + 0.1e-3 * np.sin(1000 * nodes[:, [1, 2, 0]])


def test_every_point_of_the_wall_is_found_where_it_is(coarse_mesh):
    scattered = seed(
        Phantom(density_per_mm3=300.0), coarse_mesh.nodes, coarse_mesh.cells, np.random.default_rng(0)
    ).points
    bent = _bent(coarse_mesh.nodes)
    found = locate(bent, coarse_mesh.cells, interpolate(bent, coarse_mesh.cells, scattered))
    assert (found.cell >= 0).all()
    same = [interpolate(coarse_mesh.nodes, coarse_mesh.cells, points) for points in (scattered, found)]
    assert np.abs(same[0] - same[1]).max() < 1e-15  # m: round-off of millimetres


def test_points_in_the_cavity_and_outside_are_in_no_cell(coarse_mesh):
    outside = np.array([[0, 0, -2e-3], [0, 0, 1e-3], [5e-3, 0, -1e-3], [0, 0, -9e-3], [1, 1, 1]])
    assert (locate(coarse_mesh.nodes, coarse_mesh.cells, outside).cell == -1).all()


def test_nodes_are_found_although_they_lie_on_faces(coarse_mesh):
    inner = np.setdiff1d(coarse_mesh.cells, np.concatenate([coarse_mesh.endo, coarse_mesh.epi, coarse_mesh.base]))
    for nodes in (coarse_mesh.nodes[inner], coarse_mesh.nodes[coarse_mesh.cells[:, 0]]):
        found = locate(coarse_mesh.nodes, coarse_mesh.cells, nodes)
        assert (found.cell >= 0).all()
        assert np.abs(interpolate(coarse_mesh.nodes, coarse_mesh.cells, found) - nodes).max() < 1e-15


def test_no_points_make_no_trouble(coarse_mesh):
    assert isinstance(locate(coarse_mesh.nodes, coarse_mesh.cells, np.empty((0, 3))), MaterialPoints)

"""Location of points is the inverse of interpolation."""

import numpy as np

from echotruth.config import Phantom
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import EDGES, MaterialPoints, interpolate, jacobian
from echotruth.imaging.medium.wall import seed_volume


def _bent(nodes):
    """A strongly nonuniform motion, so that all cells are curved."""
    return nodes * [1.1, 0.9, 1.05] + 0.1e-3 * np.sin(1000 * nodes[:, [1, 2, 0]])


def test_every_point_of_the_wall_is_found_where_it_is(coarse_mesh):
    scattered = seed_volume(
        Phantom(density_per_mm3=300.0), coarse_mesh.nodes, coarse_mesh.cells, np.random.default_rng(0)
    )
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


def test_no_points_are_located_in_no_cells(coarse_mesh):
    assert isinstance(locate(coarse_mesh.nodes, coarse_mesh.cells, np.empty((0, 3))), MaterialPoints)


def _crumpled(mesh):
    """Nodes shifted one by one, so that all edges bend, this way and that, by up to a tenth of the shortest."""
    ends = mesh.nodes[mesh.cells[:, EDGES]]
    most = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=-1).min() / 10
    return mesh.nodes + most * np.random.default_rng(4).uniform(-1, 1, mesh.nodes.shape) / np.sqrt(3)


def _search(positions, cells, points):
    """Cells that hold each point, by Newton's method in short steps from the middle of every cell."""
    cell = np.tile(np.arange(len(cells), dtype=np.int32), len(points))
    xi, points = np.full((len(cell), 3), 0.25), np.repeat(points, len(cells), axis=0)
    for _ in range(25):
        guess = MaterialPoints(cell, xi)
        residual = points - interpolate(positions, cells, guess)
        step = np.linalg.solve(jacobian(positions, cells, guess), residual[..., None])[..., 0]
        xi = xi + step * np.minimum(1, 0.3 / np.abs(step).max(axis=1, initial=1e-30, keepdims=True))
    inside = np.abs(points - interpolate(positions, cells, MaterialPoints(cell, xi))).max(axis=1) < 1e-12
    inside &= (xi.min(axis=1) > -1e-9) & (xi.sum(axis=1) < 1 + 1e-9)
    return [np.flatnonzero(row) for row in inside.reshape(-1, len(cells))]


def test_a_point_is_found_just_where_a_search_of_all_cells_finds_it(coarse_mesh):
    cells, random = coarse_mesh.cells, np.random.default_rng(2)
    for nodes in (_bent(coarse_mesh.nodes), _crumpled(coarse_mesh)):
        # Anywhere about the wall, and close to the faces and edges of its cells.
        anywhere = nodes.min(axis=0) + np.ptp(nodes, axis=0) * random.random((40, 3))
        close = nodes[random.integers(0, len(nodes), 40)] + 30e-6 * random.standard_normal((40, 3))
        points = np.vstack([anywhere, close])
        expected = _search(nodes, cells, points)
        assert 15 < sum(len(holding) > 0 for holding in expected) < 65
        assert list(locate(nodes, cells, points).cell) == [holding[0] if len(holding) else -1 for holding in expected]


def test_where_bodies_overlap_a_point_is_in_the_first_cell_and_every_body_is_searched(coarse_mesh):
    nodes, cells = coarse_mesh.nodes, coarse_mesh.cells
    beside = nodes + [20e-3, 0, 0]
    all_nodes, all_cells = np.vstack([nodes, beside]), np.vstack([cells, cells + len(nodes)]).astype(np.int32)
    middle = MaterialPoints(np.arange(len(cells), dtype=np.int32), np.full((len(cells), 3), 0.25))
    for body in (nodes, beside):
        positions = interpolate(body, cells, middle)
        assert np.array_equal(locate(all_nodes, all_cells, positions).cell % len(cells), middle.cell)
    overlapping = np.vstack([cells, cells])
    assert np.array_equal(locate(nodes, overlapping, interpolate(nodes, cells, middle)).cell, middle.cell)


def test_points_are_found_alike_alone_in_a_plane_and_among_others(coarse_mesh):
    bent = _bent(coarse_mesh.nodes)
    random = np.random.default_rng(3)
    positions = bent.min(axis=0) + np.ptp(bent, axis=0) * random.random((2000, 3))
    positions[:, 2] = -2e-3
    together = locate(bent, coarse_mesh.cells, positions)
    among = locate(bent, coarse_mesh.cells, np.vstack([positions, bent, np.full((1, 3), np.nan)]))
    alone = [locate(bent, coarse_mesh.cells, position[None]) for position in positions[:200]]
    assert (together.cell >= 0).any() and among.cell[-1] == -1
    for part in (MaterialPoints(among.cell[:2000], among.xi[:2000]), together):
        assert np.array_equal(part.cell[:200], [each.cell[0] for each in alone])
        assert np.array_equal(part.xi[:200], [each.xi[0] for each in alone])

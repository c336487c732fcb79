"""The wall cut out of a file."""

import numpy as np
import pytest

from echotruth.config.geometry import CellLabels
from echotruth.mechanics.geometry.boundary import adjacent_cells, boundary, triangle_edges
from echotruth.mechanics.geometry.cut import extract_wall, select_cells
from echotruth.mechanics.geometry.imported_mesh import ImportedMesh
from echotruth.mechanics.geometry.mesh_quality import GeometryError, straight_volumes


def as_imported(nodes, cells, **arrays):
    return ImportedMesh(
        "heart.vtu", np.asarray(nodes, float), np.asarray(cells, np.int32), np.empty((0, 3), np.int32), arrays
    )


@pytest.fixture
def linear(file_heart):
    """Vertices and linear tetrahedra of the heart."""
    used, cells = np.unique(file_heart.mesh.cells[:, :4], return_inverse=True)
    return file_heart.nodes[used] * 1e-3, cells.reshape(-1, 4).astype(np.int32)


def test_left_handed_tetrahedra_are_made_right_handed(linear):
    nodes, cells = linear
    turned = cells.copy()
    turned[::3] = turned[::3][:, [0, 2, 1, 3]]
    wall = extract_wall(as_imported(nodes, turned), None)
    assert straight_volumes(wall.nodes, wall.cells).min() > 0
    assert straight_volumes(wall.nodes, wall.cells) == pytest.approx(straight_volumes(nodes, cells))


def test_cells_are_kept_by_the_values_of_an_array(linear):
    nodes, cells = linear
    far = nodes + [0.1, 0, 0]
    both = as_imported(
        np.vstack([nodes, far]), np.vstack([cells, cells + len(nodes)]), part=np.repeat([3, 7], len(cells))
    )
    wall = extract_wall(both, CellLabels(array="part", values=[7]))
    assert len(wall.cells) == len(cells) and len(wall.nodes) == len(nodes)
    np.testing.assert_allclose(wall.nodes, far)


def test_ragged_cut_is_trimmed(linear):
    """Cut along cells at random: teeth and splinters go, what is left is closed and in one piece."""
    nodes, cells = linear
    height = nodes[cells].mean(axis=1) @ np.array([0.48, 0.64, 0.6])
    ragged = height + np.random.default_rng(1).normal(0, 2e-4, len(cells)) < np.quantile(height, 0.8)
    wall = extract_wall(as_imported(nodes, cells, part=ragged.astype(int)), CellLabels(array="part", values=[1]))
    facets, _ = boundary(wall.cells)
    assert np.all(triangle_edges(facets)[2] == 2)
    assert 0.7 * ragged.sum() < len(wall.cells) < ragged.sum()
    assert len(adjacent_cells(wall.cells)[0]) > len(wall.cells)


def test_wrong_array_is_answered_with_those_there(linear):
    imported = as_imported(*linear, part=np.ones(len(linear[1])), region=np.ones(len(linear[1])))
    with pytest.raises(
        GeometryError, match=r"geometry\.wall_cells\.array = 'prt' is no array of the file: its arrays .* part, region"
    ):
        extract_wall(imported, CellLabels(array="prt", values=[1]))
    with pytest.raises(GeometryError, match="it has none over cells"):
        extract_wall(as_imported(*linear), CellLabels(array="part", values=[1]))
    with pytest.raises(GeometryError, match=r"geometry\.wall_cells leaves no cell: choose others of its values"):
        extract_wall(imported, CellLabels(array="part", values=[2]))


def test_group_without_a_name(linear):
    imported = as_imported(*linear, part=np.ones(len(linear[1])))
    with pytest.raises(
        GeometryError, match=r"geometry\.wall_cells\.values = 'wall' is no physical group .* give numbers"
    ):
        select_cells(imported, CellLabels(array="part", values=["wall"]), "geometry.wall_cells")


def test_parts_that_do_not_touch(linear):
    nodes, cells = linear
    twice = as_imported(np.vstack([nodes, nodes + 0.1]), np.vstack([cells, cells + len(nodes)]))
    with pytest.raises(
        GeometryError, match=rf"in 2 parts \(of {len(cells)}, {len(cells)} tetrahedra\): choose one with geom"
    ):
        extract_wall(twice, None)


def test_parts_that_touch_in_an_edge():
    nodes = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    with pytest.raises(GeometryError, match="in 2 parts"):
        extract_wall(as_imported(nodes, [[0, 1, 2, 3], [0, 1, 4, 5]]), None)


def test_wall_that_touches_itself_along_an_edge(linear):
    """A ring of tetrahedra about an edge, two opposite ones of which are missing, closed by going round outside."""
    angle = np.arange(6) * np.pi / 3
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(6)])
    nodes = np.vstack([[0, 0, -1], [0, 0, 1], rim, [[0, 0, -3]]])
    sectors = [[0, 1, 2 + i, 2 + (i + 1) % 6] for i in (0, 1, 3, 4)]
    below = [[8, 0, 2 + i, 2 + (i + 1) % 6] for i in range(6)]
    with pytest.raises(GeometryError, match=r"touches itself along 1 edges \(non-manifold\)"):
        extract_wall(as_imported(nodes, sectors + below), None)


def test_duplicate_cells(linear):
    nodes, cells = linear
    with pytest.raises(GeometryError, match="faces belong to more than two tetrahedra: leave out duplicate cells"):
        extract_wall(as_imported(nodes, np.vstack([cells, cells[:3]])), None)


def test_folded_mesh(linear):
    nodes, cells = linear
    inside = np.setdiff1d(np.arange(len(nodes)), boundary(cells)[0])
    nodes = nodes.copy()
    nodes[inside[3]] += 3e-3
    with pytest.raises(
        GeometryError, match=r"\d+ tetrahedra are inverted, they overlap their neighbours: mesh the wall"
    ):
        extract_wall(as_imported(nodes, cells), None)

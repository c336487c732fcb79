"""The wall cut out of a file."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.config.geometry import Labels
from echotruth.mechanics.geometry.boundary import boundary, edges_of, neighbours
from echotruth.mechanics.geometry.cut import marked, volumes, wall_of
from echotruth.mechanics.geometry.imported_mesh import Body, read
from echotruth.mechanics.geometry.mesh_quality import GeometryError


def body_of(nodes, cells, **arrays):
    return Body("heart.vtu", np.asarray(nodes, float), np.asarray(cells, np.int32), np.empty((0, 3), np.int32), arrays)


@pytest.fixture
def linear(lying):
    """Vertices and linear tetrahedra of the heart."""
    used, cells = np.unique(lying.mesh.cells[:, :4], return_inverse=True)
    return lying.nodes[used] * 1e-3, cells.reshape(-1, 4).astype(np.int32)


def test_left_handed_tetrahedra_are_turned(linear):
    nodes, cells = linear
    turned = cells.copy()
    turned[::3] = turned[::3][:, [0, 2, 1, 3]]
    wall = wall_of(body_of(nodes, turned), None)
    assert volumes(wall.nodes, wall.cells).min() > 0
    assert volumes(wall.nodes, wall.cells) == pytest.approx(volumes(nodes, cells))


def test_cells_are_kept_by_the_values_of_an_array(linear):
    nodes, cells = linear
    far = nodes + [0.1, 0, 0]
    both = body_of(np.vstack([nodes, far]), np.vstack([cells, cells + len(nodes)]), part=np.repeat([3, 7], len(cells)))
    wall = wall_of(both, Labels(array="part", values=[7]))
    assert len(wall.cells) == len(cells) and len(wall.nodes) == len(nodes)
    np.testing.assert_allclose(wall.nodes, far)


def test_ragged_cut_is_mended(linear):
    """Cut along cells at random: teeth and splinters go, what is left is closed and in one piece."""
    nodes, cells = linear
    height = nodes[cells].mean(axis=1) @ np.array([0.48, 0.64, 0.6])
    ragged = height + np.random.default_rng(1).normal(0, 2e-4, len(cells)) < np.quantile(height, 0.8)
    wall = wall_of(body_of(nodes, cells, part=ragged.astype(int)), Labels(array="part", values=[1]))
    facets, _ = boundary(wall.cells)
    assert np.all(edges_of(facets)[2] == 2)
    assert 0.7 * ragged.sum() < len(wall.cells) < ragged.sum()
    assert len(neighbours(wall.cells)[0]) > len(wall.cells)


def test_wrong_array_is_answered_with_those_there(linear):
    body = body_of(*linear, part=np.ones(len(linear[1])), region=np.ones(len(linear[1])))
    with pytest.raises(GeometryError, match=r"geometry\.keep\.array = 'prt' is not there: its arrays .* part, region"):
        wall_of(body, Labels(array="prt", values=[1]))
    with pytest.raises(GeometryError, match="it has no array over cells"):
        wall_of(body_of(*linear), Labels(array="part", values=[1]))
    with pytest.raises(GeometryError, match=r"geometry\.keep leaves no cell: choose others of its values"):
        wall_of(body, Labels(array="part", values=[2]))


def test_group_without_a_name(linear):
    body = body_of(*linear, part=np.ones(len(linear[1])))
    with pytest.raises(GeometryError, match=r"geometry\.keep\.values = 'wall' is no physical group .* give numbers"):
        marked(body, Labels(array="part", values=["wall"]), "geometry.keep")


def test_parts_that_do_not_touch(linear):
    nodes, cells = linear
    twice = body_of(np.vstack([nodes, nodes + 0.1]), np.vstack([cells, cells + len(nodes)]))
    with pytest.raises(
        GeometryError, match=rf"in 2 parts \(of {len(cells)}, {len(cells)} tetrahedra\): choose one with geom"
    ):
        wall_of(twice, None)


def test_parts_that_touch_in_an_edge():
    nodes = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    with pytest.raises(GeometryError, match="in 2 parts"):
        wall_of(body_of(nodes, [[0, 1, 2, 3], [0, 1, 4, 5]]), None)


def test_wall_that_touches_itself_along_an_edge(linear):
    """A ring of tetrahedra about an edge, two opposite ones of which are missing, closed by going round outside."""
    angle = np.arange(6) * np.pi / 3
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(6)])
    nodes = np.vstack([[0, 0, -1], [0, 0, 1], rim, [[0, 0, -3]]])
    sectors = [[0, 1, 2 + i, 2 + (i + 1) % 6] for i in (0, 1, 3, 4)]
    below = [[8, 0, 2 + i, 2 + (i + 1) % 6] for i in range(6)]
    with pytest.raises(GeometryError, match=r"touches itself along 1 edges \(non-manifold\)"):
        wall_of(body_of(nodes, sectors + below), None)


def test_cells_there_twice(linear):
    nodes, cells = linear
    with pytest.raises(GeometryError, match="faces belong to more than two tetrahedra: leave out cells that are there"):
        wall_of(body_of(nodes, np.vstack([cells, cells[:3]])), None)


def test_folded_mesh(linear):
    nodes, cells = linear
    inside = np.setdiff1d(np.arange(len(nodes)), boundary(cells)[0])
    nodes = nodes.copy()
    nodes[inside[3]] += 3e-3
    with pytest.raises(
        GeometryError, match=r"\d+ tetrahedra are inverted, they overlap their neighbours: mesh the wall"
    ):
        wall_of(body_of(nodes, cells), None)


def test_file_and_memory_agree(lying, written):
    body = read(Geometry(file=written(lying.nodes, lying.mesh.cells)))
    assert len(wall_of(body, None).cells) == len(lying.mesh.cells)

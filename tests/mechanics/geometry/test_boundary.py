"""Boundaries of meshes small enough to count."""

import numpy as np

from echotruth.mechanics.geometry.boundary import (
    adjacent_cells,
    adjacent_triangles,
    area_vectors,
    boundary,
    component_labels,
    count_nonmanifold_faces,
    largest_component,
    triangle_edges,
)

NODES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
PAIR = np.array([[0, 1, 2, 3], [1, 2, 3, 4]], dtype=np.int32)


def test_boundary_of_two_tetrahedra_leaves_out_the_face_between():
    facets, owner = boundary(PAIR)
    assert len(facets) == 6 and np.bincount(owner).tolist() == [3, 3]
    assert {1, 2, 3} not in [set(facet) for facet in facets.tolist()]


def test_normals_point_out_and_cancel():
    area = area_vectors(NODES, boundary(PAIR[:1])[0])
    np.testing.assert_allclose(area.sum(axis=0), 0, atol=1e-15)
    centre = NODES[boundary(PAIR[:1])[0]].mean(axis=1) - NODES[:4].mean(axis=0)
    assert np.all(np.einsum("fi,fi->f", area, centre) > 0)


def test_adjacent_cells_share_a_face_with_opposite_normals():
    pairs, faces = adjacent_cells(PAIR)
    assert pairs.tolist() == [[0, 1]]
    assert set(faces[0, 0]) == set(faces[0, 1]) == {1, 2, 3}


def test_faces_of_a_duplicate_cell_are_non_manifold():
    assert count_nonmanifold_faces(PAIR) == 0
    assert count_nonmanifold_faces(np.vstack([PAIR, PAIR[:1]])) == 1


def test_edges_of_a_closed_surface_have_two_triangles():
    facets, _ = boundary(PAIR)
    edges, number, count = triangle_edges(facets)
    assert np.all(count == 2) and len(count) == 9 and len(edges) == len(number) == 18
    assert len(adjacent_triangles(facets)) == 9


def test_components_are_numbered_from_the_largest():
    label = component_labels(6, np.array([[0, 1], [2, 3], [3, 4]]))
    assert label[2] == label[3] == label[4] == 0 and label[0] == label[1] == 1


def test_largest_component_of_the_selected():
    selected = np.array([True, True, False, True, True, True])
    found = largest_component(selected, np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]]))
    assert found.tolist() == [False, False, False, True, True, True]

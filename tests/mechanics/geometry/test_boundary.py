"""Boundaries of meshes small enough to count."""

import numpy as np

from echotruth.mechanics.geometry.boundary import (
    area_vectors,
    beside,
    boundary,
    crowded_faces,
    edges_of,
    largest,
    neighbours,
    pieces,
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


def test_neighbours_share_a_face_that_each_sees_its_way():
    pairs, faces = neighbours(PAIR)
    assert pairs.tolist() == [[0, 1]]
    assert set(faces[0, 0]) == set(faces[0, 1]) == {1, 2, 3}


def test_cell_there_twice_crowds_its_faces():
    assert crowded_faces(PAIR) == 0
    assert crowded_faces(np.vstack([PAIR, PAIR[:1]])) == 1


def test_edges_of_a_closed_surface_have_two_triangles():
    facets, _ = boundary(PAIR)
    edges, number, count = edges_of(facets)
    assert np.all(count == 2) and len(count) == 9 and len(edges) == len(number) == 18
    assert len(beside(facets)) == 9


def test_pieces_are_numbered_from_the_largest():
    label = pieces(6, np.array([[0, 1], [2, 3], [3, 4]]))
    assert label[2] == label[3] == label[4] == 0 and label[0] == label[1] == 1


def test_largest_piece_of_what_is_chosen():
    chosen = np.array([True, True, False, True, True, True])
    found = largest(chosen, np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]]))
    assert found.tolist() == [False, False, False, True, True, True]

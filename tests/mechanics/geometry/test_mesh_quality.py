"""Measures of elements, and what is refused by them."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.mechanics.geometry.mesh_quality import (
    GeometryError,
    check_cavity,
    check_inverted,
    scaled_jacobian,
)

REGULAR = np.array([[1.0, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]])


def test_scaled_jacobian_is_one_for_the_regular_tetrahedron_and_nought_for_a_flat_one():
    cells = np.array([[0, 1, 2, 3]])
    assert abs(scaled_jacobian(REGULAR, cells)[0]) == pytest.approx(1)
    assert scaled_jacobian(REGULAR, cells)[0] == -scaled_jacobian(REGULAR, cells[:, [0, 2, 1, 3]])[0]
    assert scaled_jacobian(REGULAR * [1, 1, 0], cells)[0] == pytest.approx(0)


def test_edge_bent_through_its_cell(coarse_mesh):
    nodes, cell = coarse_mesh.nodes.copy(), coarse_mesh.cells[7]
    nodes[cell[4]] += 2 * (nodes[cell[3]] - nodes[cell[4]])
    with pytest.raises(GeometryError, match=r"heart\.vtu: \d+ of \d+ tetrahedra of the wall are inverted: remedy"):
        check_inverted(replace(coarse_mesh, nodes=nodes), "heart.vtu", "remedy")


@pytest.mark.parametrize(("factor", "volume"), [(1e-3, "uL"), (1e3, "L")])
def test_cavity_of_no_heart(coarse_mesh, factor, volume):
    with pytest.raises(GeometryError, match=rf"the cavity holds \S+ {volume}, which no heart does: remedy"):
        check_cavity(replace(coarse_mesh, nodes=factor * coarse_mesh.nodes), "heart.vtu", "remedy")

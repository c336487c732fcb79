"""Lattices: their volumes, their sides, and that neighbours fit together."""

import numpy as np
import pytest

from echotruth.mechanics.geometry.boundary import boundary
from validation import bodies


def test_volumes_are_those_of_the_bodies():
    assert bodies.bar((1, 2, 3), (1.0, 2.0, 3.0)).quadrature_points()[1].sum() == pytest.approx(6)
    assert bodies.tube((1, 24, 1), 1.5, 2.5, 1.0).quadrature_points()[1].sum() == pytest.approx(4 * np.pi, rel=1e-3)
    assert bodies.sphere_piece((2, 4, 4), 2.0, 3.0).quadrature_points()[1].sum() == pytest.approx(
        19 * np.pi / 18, rel=1e-4
    )


@pytest.mark.parametrize("around", [False, True])
def test_neighbours_share_their_nodes(around):
    body = bodies.tube((2, 6, 2), 1.0, 2.0, 1.0) if around else bodies.bar((2, 2, 2), (1.0, 1.0, 1.0))
    assert body.quadrature_points()[1].min() > 0
    facets = len(boundary(body.mesh.cells)[0])
    assert facets == (2 * (2 * 12 + 2 * 12) if around else 6 * 4 * 2)
    assert len(np.unique(body.mesh.cells)) == len(body.mesh.nodes)


def test_error_of_a_motion_is_over_the_motion():
    body = bodies.bar((1, 1, 1), (1.0, 1.0, 1.0))
    moved = np.tile([1.1, 0.0, 0.0], (len(body.mesh.nodes), 1))
    assert body.relative_rms_error(
        moved, lambda points: np.broadcast_to([1.0, 0.0, 0.0], points.shape)
    ) == pytest.approx(0.1)


def test_nodal_area_vectors_add_up_to_the_area_of_the_face():
    mesh = bodies.bar((1, 2, 1), (1.0, 2.0, 1.0)).mesh
    assert bodies.nodal_area_vectors(mesh.nodes, mesh.endo).sum(axis=(0, 1)) == pytest.approx([-2.0, 0.0, 0.0])
    turned = np.roll(1.5 * mesh.nodes, 1, axis=1)
    assert bodies.nodal_area_vectors(turned, mesh.endo).sum(axis=(0, 1)) == pytest.approx([0.0, -4.5, 0.0])

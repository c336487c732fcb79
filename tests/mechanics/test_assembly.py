"""The support of the base."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.assembly import Assembly
from echotruth.mechanics.solver.support import base_support


@pytest.fixture(scope="module")
def mesh():
    return left_ventricle(Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1))


def test_free_base_moves_along_its_radius_only(mesh):
    assembly = Assembly(mesh, base_support(mesh, "radial_free"))
    moved = assembly.displacement(np.random.default_rng(0).normal(size=assembly.n_equations))[np.unique(mesh.base)]
    radial = mesh.nodes[np.unique(mesh.base)]
    np.testing.assert_allclose(np.cross(moved, radial), 0, atol=1e-15)
    assert np.all(np.linalg.norm(moved, axis=1) > 0)


def test_fixed_base_does_not_move(mesh):
    assembly = Assembly(mesh, base_support(mesh, "fixed"))
    moved = assembly.displacement(np.ones(assembly.n_equations))
    assert np.all(moved[mesh.base] == 0)
    assert assembly.n_equations == 3 * (len(mesh.nodes) - len(np.unique(mesh.base)))
    assert Assembly(mesh, base_support(mesh, "elastic")).n_equations == 3 * len(mesh.nodes)

"""The loops of NumPy and the compiled ones do the same."""

import numpy as np
import pytest

from echotruth.fem import compiled, location, tetrahedra, vectorised
from echotruth.fem.tetrahedra import MaterialPoints, interpolate


@pytest.mark.parametrize("share", [0.0, 0.1e-3])
def test_loops_without_numba_give_the_same_bits(coarse_mesh, monkeypatch, share):
    """On straight and on curved cells, at points in them, on their faces, and outside."""
    random, cells, count = np.random.default_rng(5), coarse_mesh.cells, 3000
    nodes = coarse_mesh.nodes + share * np.sin(1000 * coarse_mesh.nodes[:, [1, 2, 0]])
    tissue = MaterialPoints(
        random.integers(0, len(cells), count).astype(np.int32), random.dirichlet(np.ones(4), count)[:, :3].copy()
    )
    points = [interpolate(nodes, cells, tissue), random.uniform(-8e-3, 8e-3, (count, 3)), nodes]

    def loops(module):
        for user in (tetrahedra, location):
            monkeypatch.setattr(user, "kernels", lambda: module)
        found = location.locate(nodes, cells, np.concatenate(points))
        gradients = tetrahedra.gradient(coarse_mesh.nodes, nodes, cells, tissue)
        return tetrahedra.interpolate(nodes, cells, tissue), gradients, found.cell, found.xi

    for ours, theirs in zip(loops(vectorised), loops(compiled), strict=True):
        np.testing.assert_array_equal(ours, theirs)

"""Arrival times against exact ones: plane waves, waves from a point along and across fibres, and shortcuts."""

import numpy as np
import pytest

from echotruth.mechanics.eikonal import arrival_times

FIBRE = np.array([1.0, 2.0, 2.0]) / 3
ALONG, ACROSS = 0.6, 0.25
METRIC = np.eye(3) / ACROSS**2 + (ALONG**-2 - ACROSS**-2) * np.outer(FIBRE, FIBRE)

KUHN = np.array([(0, 1, 3, 7), (0, 1, 5, 7), (0, 2, 3, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 4, 6, 7)])
"""Tetrahedra of a cube whose corner i + 2 j + 4 k lies at (i, j, k)."""


def box(n):
    """A cube of a centimetre of n^3 cubes of six tetrahedra each."""
    index = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    nodes = np.stack(np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) * 1e-2 / n
    corners = [index[i : n + i, j : n + j, k : n + k].ravel() for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    return nodes, np.stack(corners, axis=-1)[:, KUHN].reshape(-1, 4)


def times(nodes, cells, start, metric=METRIC):
    return arrival_times(nodes, cells, np.tile(metric, (len(cells), 1, 1)), start)


@pytest.mark.parametrize("axis", range(3))
def test_a_plane_wave_along_a_principal_axis_is_exact(axis):
    nodes, cells = box(5)
    slowness = 1 / np.array([0.6, 0.3, 0.2])
    start = np.where(nodes[:, axis] == 0, 2e-3, np.inf)
    found = times(nodes, cells, start, np.diag(slowness**2))
    np.testing.assert_allclose(found, 2e-3 + slowness[axis] * nodes[:, axis], rtol=1e-12)


def test_a_wave_from_a_point_comes_to_the_ellipsoid_of_its_speeds_as_the_mesh_is_refined():
    errors = []
    for n in (6, 12, 24):
        nodes, cells = box(n)
        way = nodes - 5e-3
        exact = np.sqrt(np.einsum("ni,ij,nj->n", way, METRIC, way))
        # Exact times within a ball that does not shrink, so that the error is that of the spread alone.
        found = times(nodes, cells, np.where(np.linalg.norm(way, axis=1) < 2e-3, exact, np.inf))
        assert np.all(found >= exact * (1 - 1e-12))
        errors.append(np.sqrt(np.mean((found - exact) ** 2)) / exact.max())
    assert errors[-1] < 0.01
    assert errors[1] < 0.65 * errors[0] and errors[2] < 0.65 * errors[1]


def test_a_fast_surface_carries_the_wave_ahead_of_the_muscle():
    """Along a sheet of speed V the front reaches x at x / V, and the muscle below at the angle of a head wave:
    T = x / V + z sqrt(1 / v^2 - 1 / V^2), where that is earlier than the direct way."""
    nodes, cells = box(24)
    x, _, z = nodes.T
    index = np.flatnonzero(z == 0).reshape(25, 25)
    corners = [index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:]]
    a, b, c, d = (corner.ravel() for corner in corners)
    sheet = np.stack([np.stack([a, b, d, d], axis=1), np.stack([a, c, d, d], axis=1)]).reshape(-1, 4)
    slow, fast = 0.25, 1.0
    metric = np.concatenate(
        [np.tile(np.eye(3) / v**2, (len(part), 1, 1)) for part, v in ((cells, slow), (sheet, fast))]
    )
    found = arrival_times(nodes, np.concatenate([cells, sheet]), metric, np.where(x == 0, 0.0, np.inf))
    np.testing.assert_allclose(found[z == 0], x[z == 0] / fast, rtol=1e-12)
    head = x / fast + z * np.sqrt(slow**-2 - fast**-2)
    np.testing.assert_allclose(found, np.minimum(head, x / slow), atol=0.005 * found.max())


def test_what_no_wave_reaches_has_no_time():
    nodes, cells = box(2)
    apart = np.concatenate([cells, cells + len(nodes)])
    start = np.full(2 * len(nodes), np.inf)
    start[0] = 0.0
    found = times(np.concatenate([nodes, nodes + 1.0]), apart, start)
    assert np.isfinite(found[: len(nodes)]).all() and np.isinf(found[len(nodes) :]).all()

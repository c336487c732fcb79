"""Lines through a sphere."""

import numpy as np
import pytest

from echotruth.mechanics.geometry.rays import Rays, sphere_directions


@pytest.fixture(scope="module")
def ball():
    import pyvista

    sphere = pyvista.Sphere(radius=3e-3, theta_resolution=60, phi_resolution=60)
    return Rays(np.asarray(sphere.points, dtype=float), sphere.regular_faces)


def test_lines_meet_a_sphere_where_they_should(ball):
    directions = sphere_directions(50)
    for hits in ball.intersections(np.zeros_like(directions), directions):
        assert hits[0] == pytest.approx(3e-3, rel=5e-3)
    assert len(ball.intersections(np.array([[0.0, 0, -9e-3]]), np.array([[0.1, 0.2, 1.0]]) / np.sqrt(1.05))[0]) == 2
    assert len(ball.intersections(np.array([[0.0, 0, -9e-3]]), np.array([[1.0, 0, 0]]))[0]) == 0


@pytest.mark.parametrize("resolution", [24, 36, 60])
def test_lines_through_edges_and_vertices_meet_the_surface(resolution):
    """The sphere has edges along its meridians and, as it stands on the origin, every line here runs in one of them."""
    import pyvista

    sphere = pyvista.Sphere(radius=3e-3, theta_resolution=resolution, phi_resolution=resolution, direction=(0, 0, 1))
    azimuth = 2 * np.pi * np.arange(resolution) / resolution
    start = np.repeat([[0.0, 0.0, 0.4e-3]], resolution, axis=0)
    directions = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)])
    for sign in (1, -1):
        found = Rays(np.asarray(sphere.points, dtype=float), sphere.regular_faces).intersections(
            sign * start, sign * directions
        )
        assert [len(hits) for hits in found] == [1] * resolution
        np.testing.assert_allclose(np.concatenate(found), np.sqrt(3**2 - 0.4**2) * 1e-3, rtol=5e-3)


def test_distance_from_the_surface(ball):
    assert ball.distances(np.array([[0, 0, 1e-3], [0, 5e-3, 0]])) == pytest.approx([2e-3, 2e-3], rel=0.01)


def test_directions_are_even_over_the_sphere():
    directions = sphere_directions(500)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    np.testing.assert_allclose(directions.T @ directions / 500, np.eye(3) / 3, atol=2e-3)

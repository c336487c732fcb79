import numpy as np
import pytest

from echotruth.tracking.wall_rays import DEPTHS, DIRECTIONS, RAYS, wall_rays

SIZE, CENTRE = 128, np.array([60.0, 70.0])


def ring(inner=20, outer=40, opening=0.0):
    """Ring about `CENTRE`, without a sector about the axial direction of this half-width, rad."""
    column, row = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    x, y = column - CENTRE[0], row - CENTRE[1]
    radius, angle = np.hypot(x, y), np.abs(np.arctan2(x, y))
    return (radius > inner) & (radius < outer) & (angle >= opening)


def test_rays_of_a_ring_enter_and_leave_at_its_radii():
    rays = wall_rays(ring())
    assert np.abs(rays.centre - CENTRE).max() < 0.2 and rays.crosses.all()
    assert np.abs(rays.inner - 20).max() < 0.8 and np.abs(rays.outer - 40).max() < 0.8
    radius = np.linalg.norm(rays.points - CENTRE, axis=-1)
    assert np.abs(radius.mean(1) - (20 + 20 * (np.arange(DEPTHS) + 0.5) / DEPTHS)).max() < 0.5


def test_rays_through_the_open_base_cross_no_wall():
    rays = wall_rays(ring(opening=0.5))
    through = DIRECTIONS[:, 1] > np.cos(0.4)
    assert not rays.crosses[through].any() and rays.crosses[DIRECTIONS[:, 1] < 0].all()
    assert np.isfinite(rays.points).all()


def test_components_along_and_across_are_turned_back():
    rays, vectors = wall_rays(ring()), np.random.default_rng(1).normal(size=(3, RAYS, 2))
    np.testing.assert_allclose(rays.in_image(rays.along_and_across(vectors)), vectors, atol=1e-12)
    np.testing.assert_allclose(rays.along_and_across(DIRECTIONS), np.tile([1.0, 0.0], (RAYS, 1)), atol=1e-12)


def test_values_are_interpolated_between_rays_and_depths():
    rays = wall_rays(ring())
    field = rays.points @ np.array([[0.1, 0.02], [-0.03, 0.2]])  # linear in the place
    points = np.argwhere(ring(24, 36))[::37, ::-1].astype(float)
    expected = points @ np.array([[0.1, 0.02], [-0.03, 0.2]])
    assert np.abs(rays.interpolate(field, points) - expected).max() < 0.12


def test_rays_that_cross_no_wall_do_not_count():
    mask = ring(opening=0.5)
    rays = wall_rays(mask)
    values = np.where(rays.crosses, 3.0, np.nan)[None].repeat(DEPTHS, 0)
    points = np.argwhere(mask)[:, ::-1].astype(float)
    np.testing.assert_allclose(rays.interpolate(values, points), 3.0, rtol=1e-12)


def test_what_lies_beside_the_wall_makes_it_no_thicker():
    column, row = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    muscle, speck = (np.hypot(column - x, row - CENTRE[1]) < 3 for x in (CENTRE[0] + 12, CENTRE[0] + 60))
    rays, plain = wall_rays(ring() | muscle | speck), wall_rays(ring())
    assert np.abs(rays.inner - plain.inner).max() < 1.5 and np.abs(rays.outer - plain.outer).max() < 1.5


def test_dent_outside_is_no_cavity_though_it_is_larger():
    column, row = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    rays = wall_rays(ring(6, 40) & (np.hypot(column - CENTRE[0], row - CENTRE[1] - 45) > 20))
    assert np.abs(rays.centre - CENTRE).max() < 0.5 and rays.crosses.all()


@pytest.mark.parametrize("mask", [np.zeros((32, 32), bool), np.ones((32, 32), bool), ring(-1), ring(opening=2.5)])
def test_wall_without_cavity_is_told(mask):
    with pytest.raises(ValueError, match=r"wall (is empty|surrounds no cavity)"):
        wall_rays(mask)

"""The strain operator: exact where it should be, of known order elsewhere, and no further than the wall."""

import numpy as np
import pytest

from echotruth.evaluation.local_fit import LocalFit
from echotruth.evaluation.strain import MAX_SPACING, StrainOperator

INNER, OUTER = 1.45e-3, 2.45e-3


def annulus(step, radius):
    """The operator on a grid in the cross-section of a ventricle; radial outwards, tangential counter-clockwise."""
    x = np.arange(-OUTER, OUTER, step) + step / 3
    position = np.stack(np.meshgrid(x, x), -1).reshape(-1, 2)
    position = position[np.abs(np.hypot(*position.T) - (INNER + OUTER) / 2) < (OUTER - INNER) / 2]
    outwards = position / np.hypot(*position.T)[:, None]
    axes = np.stack([outwards, np.stack([-outwards[:, 1], outwards[:, 0]], -1)], 1)
    return StrainOperator(position, axes, radius)


@pytest.fixture(scope="module")
def wall():
    return annulus(0.117e-3, 0.45e-3)


def test_affine_motion_has_its_strain_at_every_point(wall):
    gradient = np.array([[0.2, -0.13], [0.07, -0.18]])
    found = wall.strain((wall.position @ gradient.T + 4e-4)[None])[0]
    green = ((np.eye(2) + gradient).T @ (np.eye(2) + gradient) - np.eye(2)) / 2
    for k, (a, b) in enumerate(((0, 0), (1, 1), (0, 1))):
        expected = np.einsum("ni,ij,nj->n", wall.axes[:, a], green, wall.axes[:, b])
        np.testing.assert_allclose(found[:, k], expected, atol=1e-12)


def test_slope_of_a_quadratic_field_is_exact_to_the_borders_of_the_wall(wall):
    x, y = wall.position.T * 1e3
    moved = 1e-3 * np.stack([0.1 * x * x - 0.2 * x * y, 0.3 * y * y + 0.05 * x], -1)
    expected = np.moveaxis(np.array([[0.2 * x - 0.2 * y, -0.2 * x], [0.05 + 0 * x, 0.6 * y]]), -1, 0)
    np.testing.assert_allclose(wall.gradient(moved[None])[0], expected, atol=1e-11)


def twisting(wall):
    """Isochoric contraction r^2 = R^2 - R_i^2 + r_i^2 with a twist that falls to the epicardium, and its strain.

    From F_rR = R / r, F_tR = r a', F_tT = r / R in polar coordinates.
    """
    undeformed = np.hypot(*wall.position.T)
    turn, slope = 0.15 - 120 * (undeformed - INNER), -120.0
    deformed = np.sqrt(undeformed**2 - INNER**2 + 1.1e-3**2)
    angle = np.arctan2(wall.position[:, 1], wall.position[:, 0]) + turn
    moved = deformed[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1) - wall.position
    radial = ((undeformed / deformed) ** 2 + (deformed * slope) ** 2 - 1) / 2
    return moved, np.stack([radial, ((deformed / undeformed) ** 2 - 1) / 2, deformed**2 * slope / undeformed / 2], -1)


def test_contraction_with_twist_has_the_strain_of_its_closed_form(wall):
    moved, expected = twisting(wall)
    error = wall.strain(moved[None])[0] - expected
    assert expected[:, 0].max() > 0.25 and expected[:, 1].min() < -0.15
    assert (np.sqrt(np.mean(error**2, axis=0)) < [0.02, 0.01, 0.01]).all()


def test_error_falls_with_the_square_of_the_radius():
    errors = []
    for step, radius in ((0.1e-3, 0.4e-3), (0.05e-3, 0.2e-3)):
        wall = annulus(step, radius)
        moved, expected = twisting(wall)
        errors.append(np.sqrt(np.mean((wall.strain(moved[None])[0] - expected) ** 2, axis=0)))
    assert (errors[0] / errors[1] > 3.5).all()


def test_still_tissue_has_no_strain_and_frames_do_not_mix(wall):
    moved, _ = twisting(wall)
    found = wall.strain(np.stack([0 * moved, moved, 0 * moved]))
    assert np.abs(found[[0, 2]]).max() < 1e-12
    np.testing.assert_array_equal(found[1], wall.strain(moved[None])[0])


def test_strain_where_points_are_lost_is_that_of_a_wall_without_them(wall):
    moved = np.repeat(twisting(wall)[0][None], 4, axis=0)
    random = np.random.default_rng(5)
    for frame, fraction in ((1, 0.01), (2, 0.1), (3, 0.6)):
        moved[frame, random.random(len(wall.position)) < fraction] = np.nan
    found = wall.strain(moved)
    assert np.isnan(found[~np.isfinite(moved).all(-1)]).all()
    for frame in range(4):
        known = np.isfinite(moved[frame]).all(-1)
        without = StrainOperator(wall.position[known], wall.axes[known], wall.radius).strain(
            moved[frame : frame + 1, known]
        )
        np.testing.assert_allclose(found[frame, known], without[0], atol=1e-11)


def test_too_few_points_or_all_on_a_line_have_no_strain():
    line = np.stack([np.linspace(0, 1e-3, 30), np.zeros(30)], -1)
    axes = np.broadcast_to(np.eye(2), (30, 2, 2))
    assert np.isnan(StrainOperator(line, axes, 0.45e-3).strain(line[None])).all()
    scattered = np.random.default_rng(0).uniform(0, 3e-4, (9, 2))
    assert np.isnan(StrainOperator(scattered, axes[:9], 0.45e-3).strain(scattered[None])).all()


def test_the_wall_across_a_narrow_cavity_is_no_neighbour():
    place = np.stack(np.meshgrid(np.arange(0, 1e-3, 1e-4), np.arange(0, 8e-4, 1e-4)), -1).reshape(-1, 2)
    position = np.concatenate([place + [0, 1e-4], place * [1, -1] - [0, 1e-4]])
    upper = np.arange(len(position)) < len(place)
    normal = np.where(upper[:, None], [0.0, 1.0], [0.0, -1.0])
    operator = StrainOperator(position, np.stack([normal, np.tile([1.0, 0.0], (len(position), 1))], 1), 0.45e-3)
    shifted = np.where(upper[:, None], [0.0, -5e-5], [0.0, 5e-5])
    assert np.abs(operator.strain(shifted[None])).max() < 1e-12


@pytest.mark.parametrize("wall", [0.7, 1.0, 1.3])
def test_spacing_up_to_which_borders_of_a_wall_have_strain(wall):
    """Points of a ring of tissue, mm, on grids around the largest spacing that is advised."""
    angle, radius = np.linspace(0, 2 * np.pi, 90), 0.45
    border = 1.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    for factor, low, high in ((0.9, 0.9, 1.0), (1.3, 0.0, 0.02)):
        line = np.arange(-3, 3, factor * MAX_SPACING * radius)
        grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        away = np.linalg.norm(grid, axis=1)
        points = grid[(away > 1.5) & (away < 1.5 + wall)]
        normals = points / np.linalg.norm(points, axis=1)[:, None]
        fit = LocalFit(points, normals, border, border / 1.5, radius)
        known = np.isfinite(fit(np.zeros((1, len(points), 2)))[0, :, 0, 0]).mean()
        assert low <= known <= high

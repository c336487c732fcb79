"""Strain, rotation, rates and peaks over the cycle against lengths, angles and curves that are known."""

import numpy as np

from echotruth.evaluation.courses import motion_courses, peak, rate, rotation, strain_courses, systolic_rate
from echotruth.evaluation.displacement_error import WallPoints
from echotruth.evaluation.strain import engineering
from echotruth.mechanics.kinematics import IMAGE_COMPONENTS, strain

RANDOM = np.random.default_rng(4)
LAYER, SEGMENT = np.tile(np.arange(1, 7), 10), np.repeat(np.arange(7, 12), 12)


def wall(position=None, plane="short_axis"):
    position = np.zeros((60, 2)) if position is None else position
    return WallPoints(position, LAYER[: len(position)], SEGMENT[: len(position)], np.zeros(2), plane)


def test_engineering_strain_is_the_change_of_length_and_of_angle_of_lines_in_the_tissue():
    gradient = np.eye(2) + 0.3 * RANDOM.uniform(-1, 1, (50, 2, 2))
    angle = RANDOM.uniform(0, 2 * np.pi, 50)
    axes = np.stack([np.stack([np.cos(angle), np.sin(angle)], -1), np.stack([-np.sin(angle), np.cos(angle)], -1)], 1)
    found = engineering(strain(gradient, axes, IMAGE_COMPONENTS))
    radial, tangential = (np.einsum("nij,nj->ni", gradient, axes[:, k]) for k in (0, 1))
    lengths = [np.linalg.norm(line, axis=-1) for line in (radial, tangential)]
    np.testing.assert_allclose(found[:, :2], np.stack(lengths, -1) - 1, atol=1e-12)
    between = np.arccos(np.sum(radial * tangential, -1) / (lengths[0] * lengths[1]))
    np.testing.assert_allclose(found[:, 2], np.pi / 2 - between, atol=1e-12)


def test_mean_engineering_strain_is_that_of_the_points_and_not_of_the_mean():
    tangential = np.where(np.arange(60) < 30, -0.32, 0.22)  # stretches of 0.6 and 1.2
    green = np.zeros((1, 60, 3))
    green[..., 1] = tangential
    found = strain_courses(green, wall())["region_strain"]
    assert found.shape == (1, 2, 7, 3)
    np.testing.assert_allclose(found[0, :, 0, 1], [(-0.4 + 0.2) / 2, (-0.32 + 0.22) / 2])


def test_regions_and_segments_are_means_over_the_points_that_are_known():
    green = 0.1 * RANDOM.normal(size=(4, 60, 3))
    green[:, ::2] = np.nan
    found, odd = strain_courses(green, wall()), np.arange(60) % 2 == 1
    np.testing.assert_allclose(found["region_strain"][:, 1, 0], green[:, odd].mean(1))
    np.testing.assert_allclose(found["region_strain"][:, 1, 2], green[:, odd & (LAYER == 2)].mean(1))
    assert np.isnan(found["region_strain"][:, :, 1]).all()  # layer 1 has even points only
    np.testing.assert_allclose(found["segment_strain"][:, 1, 8], green[:, odd & (SEGMENT == 9)].mean(1))
    assert np.isnan(found["segment_strain"][:, :, [0, 16]]).all()


def turned(position, angle, centre):
    """Positions turned counter-clockwise in an image whose second axis points down."""
    cos, sin = np.cos(angle), np.sin(angle)
    matrix = np.moveaxis(np.array([[cos, sin], [-sin, cos]]), -1, 0)
    return np.einsum("fij,pj->fpi", matrix, position - centre) + centre


def test_rotation_is_the_angle_of_a_turn_that_also_moves_and_shrinks():
    position = RANDOM.normal(size=(60, 2)) * 1e-3
    angle = np.radians([0, 3, -7, 100, 200])
    moved = 0.8 * turned(position, angle, np.array([2e-3, -1e-3])) + np.arange(5)[:, None, None] * 1e-3
    np.testing.assert_allclose(rotation(position, moved - position), angle, atol=1e-12)


def test_rotation_of_the_points_that_are_known_in_a_frame_is_that_of_the_wall():
    position = RANDOM.normal(size=(60, 2)) * 1e-3
    angle = np.radians([0, 3, -7, 5])
    moved = turned(position, angle, np.zeros(2)) - position
    moved[1, :40] = np.nan
    moved[2, 1:] = np.nan
    found = rotation(position, moved)
    np.testing.assert_allclose(found[[0, 1, 3]], angle[[0, 1, 3]], atol=1e-12)
    assert np.isnan(found[2])


class NoContours:
    def line_strain(self, displacement):
        return np.zeros((len(displacement), 3))


def test_a_long_axis_has_no_rotation():
    position = RANDOM.normal(size=(60, 2)) * 1e-3
    moved = turned(position, np.radians([0.0, 4.0]), np.zeros(2)) - position
    short, long = (motion_courses(moved, moved, wall(position, plane), NoContours()) for plane in WALLS)
    np.testing.assert_allclose(np.degrees(short["rotation"]), [0, 4], atol=1e-9)
    assert np.isnan(long["rotation"]).all()


WALLS = ("short_axis", "long_axis")


def test_rate_of_a_parabola_is_exact_to_the_ends():
    time = np.linspace(0, 0.12, 30)
    np.testing.assert_allclose(rate(3 - 2 * time + 40 * time**2, time), 80 * time - 2, atol=1e-9)
    assert np.isnan(rate(np.zeros(2), time[:2])).all()


def test_peak_of_a_known_curve_has_its_sign_and_its_time():
    time = 3e-3 * np.arange(40)
    middle = time[13]
    shortening, thickening = (height * np.exp(-(((time - middle) / 0.02) ** 2)) for height in (-0.2, 0.45))
    bulging = 0.05 * np.exp(-(((time - time[4]) / 0.01) ** 2)) - 0.2 * np.exp(-(((time - time[30]) / 0.01) ** 2))
    value, when = peak(np.stack([shortening, thickening, bulging, -bulging], -1), time)
    np.testing.assert_allclose(value, [-0.2, 0.45, -0.2, 0.2])
    np.testing.assert_allclose(when, [time[13], time[13], time[30], time[30]])


def test_systolic_rate_is_the_fastest_shortening_or_thickening_and_not_the_stretch_before():
    rates = np.array([[3.0, -3.0, 1.0], [-2.0, 2.0, np.nan], [-1.0, 1.0, 0.0]])
    np.testing.assert_array_equal(systolic_rate(rates, np.array([-0.1, 0.1, 0.1])), [-2, 2, np.nan])
    assert np.isnan(systolic_rate(rates, np.full(3, np.nan))).all()


def test_tissue_that_does_not_move_has_a_peak_of_zero_and_no_time_of_it():
    time = 3e-3 * np.arange(5)
    value, when = peak(np.stack([np.zeros(5), 1e-6 * np.arange(5), [0, -0.1, np.nan, -0.1, 0]], -1), time)
    np.testing.assert_allclose(value, [0, 4e-6, np.nan])
    assert np.isnan(when).all()

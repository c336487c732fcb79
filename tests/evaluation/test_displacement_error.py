import numpy as np
import pytest

from echotruth.evaluation.displacement_error import WallPoints, evaluate, transmural_gradient
from echotruth.evaluation.polar import directions, resolve

ORIGIN = np.array([1e-3, 6e-3])


def ring(points=24, layers=6):
    """Points on circles about the origin, one a layer; segment 1 for the upper half, 4 for the lower."""
    angle = np.repeat(2 * np.pi * (np.arange(points) + 0.5) / points, layers)
    layer = np.tile(np.arange(1, layers + 1), points)
    arm = (1.5e-3 + 0.15e-3 * layer)[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    segment = np.where(arm[:, 1] < 0, 1, 4)
    return WallPoints(ORIGIN + arm, layer, segment, ORIGIN, "short_axis", layers), arm


def clip(displacement):
    return np.stack([np.zeros_like(displacement), displacement])


def test_directions_on_the_screen():
    """Axial points down the screen, so that counter-clockwise is up on the right and right at the bottom."""
    position = ORIGIN + np.array([[1e-3, 0], [0, 2e-3], [-1e-3, 0], [0, -1e-3]])
    radial, tangential = np.moveaxis(directions(position, ORIGIN, "short_axis"), 1, 0)
    np.testing.assert_allclose(radial, [[1, 0], [0, 1], [-1, 0], [0, -1]], atol=1e-12)
    np.testing.assert_allclose(tangential, [[0, -1], [1, 0], [0, 1], [-1, 0]], atol=1e-12)


def test_long_axis_is_transverse_and_longitudinal():
    position = ORIGIN + np.array([[1e-3, 0], [-1e-3, 2e-3]])
    moved = resolve(np.array([[0.1, 0.2], [0.1, 0.2]]), position, ORIGIN, "long_axis")
    np.testing.assert_allclose(moved, [[0.1, 0.2], [-0.1, 0.2]])


def test_components_in_a_long_axis_turn_with_the_probe():
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    arm, vector = np.array([[1e-3, 0], [-1e-3, 2e-3]]), np.array([[0.1, 0.2], [0.3, -0.2]])
    upright = resolve(vector, ORIGIN + arm, ORIGIN, "long_axis")
    turned = resolve(vector @ turn.T, ORIGIN + arm @ turn.T, ORIGIN, "long_axis", (0.6, 0.8))
    np.testing.assert_allclose(turned, upright, atol=1e-15)


def test_rotation_is_tangential_and_scaling_radial():
    wall, arm = ring()
    turned = 0.1 * np.stack([arm[:, 1], -arm[:, 0]], -1)
    found = evaluate(clip(-0.2 * arm), clip(turned), wall, 1)
    radius = np.hypot(*arm.T)
    for moved, components in ((turned, (0 * radius, 0.1 * radius)), (-0.2 * arm, (-0.2 * radius, 0 * radius))):
        polar = resolve(moved, wall.position, ORIGIN, "short_axis")
        np.testing.assert_allclose(polar, np.stack(components, -1), atol=1e-12)
    np.testing.assert_allclose(found["rms_error"][1] / 1.65e-3, [0.2, 0.1, np.sqrt(0.05)])
    np.testing.assert_allclose(found["nrmse"][1, 1:], [1, np.sqrt(5)])


def test_zero_estimate_has_unit_error():
    wall, arm = ring()
    true = np.random.default_rng(0).normal(size=(2, len(arm), 2))
    found = evaluate(np.zeros_like(true), true, wall, 1)
    assert (found["nrmse"] == 1).all() and found["nrmse"].shape == (7, 3)
    assert found["coverage"] == 1


def test_spread_of_a_layer_and_its_transmural_gradient():
    wall, arm = ring()
    # Half the points of a layer turn by +a and half by -a: the standard deviation is a.
    size = np.array([8, 7, 6, 5, 4.5, 4])[wall.layer - 1] * 1e-5 * np.where(arm[:, 1] < 0, 1, -1)
    tangential = directions(wall.position, ORIGIN, "short_axis")[:, 1]
    found = evaluate(clip(0 * arm), clip(size[:, None] * tangential), wall, 1)
    np.testing.assert_allclose(found["true_displacement_sd"][[1, 6], 1], [8e-5, 4e-5])
    assert found["true_transmural_gradient"] == pytest.approx(50)
    assert np.isnan(found["tracked_transmural_gradient"]).all()
    np.testing.assert_allclose(found["true_segment_displacement"][[0, 3], 1], np.array([1, -1]) * 5.75e-5)
    assert np.isnan(found["true_segment_displacement"][1]).all()


def test_transmural_gradient_is_negative_where_the_spread_grows_outwards():
    assert transmural_gradient(4e-5, 5e-5) == pytest.approx(-25)


def test_points_without_estimate_count_only_in_the_coverage():
    wall, arm = ring()
    tracked = clip(0.9 * arm)
    tracked[1, wall.layer == 2] = np.nan
    tracked[1, np.flatnonzero(wall.layer == 3)[:12]] = np.nan
    found = evaluate(tracked, clip(arm), wall, 1)
    np.testing.assert_allclose(found["nrmse"][[0, 1, 3], 0], 0.1)
    assert np.isnan(found["nrmse"][2]).all() and np.isnan(found["tracked_displacement_sd"][2]).all()
    assert found["coverage"] == pytest.approx(0.75)


def test_points_outside_the_wall_do_not_count():
    wall, arm = ring()
    layer = np.where(arm[:, 0] > 0, wall.layer, 0)
    true = clip(arm)
    tracked = clip(np.where(arm[:, :1] > 0, arm, 99.0))
    found = evaluate(tracked, true, WallPoints(wall.position, layer, wall.segment, ORIGIN, "short_axis"), 1)
    assert (found["rms_error"] == 0).all() and found["coverage"] == 1


def test_no_wall_is_all_nan():
    wall, arm = ring()
    found = evaluate(clip(arm), clip(arm + np.nan), wall, 1)
    assert (
        np.isnan(found["coverage"])
        and np.isnan(found["nrmse"]).all()
        and np.isnan(found["true_segment_displacement"]).all()
    )


def test_one_point_has_no_spread():
    wall, arm = ring(points=1)
    found = evaluate(clip(arm), clip(arm), wall, 1)
    assert np.isfinite(found["nrmse"]).all()
    assert np.isnan(found["tracked_displacement_sd"][1:]).all() and np.isnan(found["tracked_transmural_gradient"]).all()

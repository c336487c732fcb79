"""Score of one clip, and its metrics in the units that their names give."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.evaluation.contours import Contours
from echotruth.evaluation.displacement_error import WallPoints
from echotruth.evaluation.points import Truth
from echotruth.evaluation.polar import directions
from echotruth.evaluation.scoring import metrics, score
from echotruth.evaluation.strain import StrainOperator

STEP = 0.117e-3


def ventricle(plane="short_axis"):
    """A short-axis slice that shrinks to 0.9 by the middle of five frames and is back in the last."""
    x = STEP * (np.arange(45) - 22)
    grid = np.stack(np.meshgrid(x, x), -1)
    distance = np.hypot(*np.moveaxis(grid, -1, 0))
    inside = (distance > 1.4e-3) & (distance < 2.4e-3)
    position = grid[inside]
    layer = np.ceil(6 * (distance[inside] - 1.4e-3) / 1e-3).astype(np.uint8)
    segment = (7 + np.floor((np.arctan2(*position.T) + np.pi) / (np.pi / 3)) % 6).astype(np.uint8)
    axes = directions(position, np.zeros(2), "short_axis")
    operator = StrainOperator(position, axes, 0.45e-3)
    fraction = np.array([0, -0.05, -0.1, -0.05, 0])[:, None, None]
    strain = ((1 + fraction) ** 2 - 1) / 2 * np.array([1.0, 1.0, 0.0])
    wall = WallPoints(position, layer, segment, np.zeros(2), plane)
    out = 1e-4 * np.sin(np.arange(5))[:, None] * np.ones(len(position))
    everywhere = np.broadcast_to(strain, (3, 5, len(position), 3))
    lines, time = rings(fraction), 3e-3 * np.arange(5)
    return Truth(inside, wall, operator, fraction * position, out, everywhere, 2, lines, time)


LATER = 1.5 * np.array([0, -0.05, -0.1, -0.05, 0])[:, None, None]


def rings(fraction):
    """Endocardial, middle and epicardial contour, all of which change by a fraction (frame, 1, 1)."""
    angle = np.linspace(0, 2 * np.pi, 121)
    circle = np.stack([np.cos(angle), np.sin(angle)], -1)
    ends = np.stack([circle[:-1], circle[1:]], 1)
    position = np.concatenate([radius * ends for radius in (1.41e-3, 1.9e-3, 2.39e-3)])
    return Contours(position, fraction[..., None] * position, np.repeat(np.arange(3), len(ends)))


@pytest.fixture(scope="module")
def truth():
    return ventricle()


def tracked(truth, displacement):
    return truth.on_grid(displacement, 1)


def test_the_truth_itself_has_no_error(truth):
    found = metrics(score(tracked(truth, truth.displacement), truth), "short_axis")
    for name, value in found.items():
        # What is the same at every point correlates with nothing: the error, and the strain of this slice.
        perfect = np.nan if name.endswith("correlation") else {"coverage_percent": 100}.get(name, 0)
        if "e_ll_" in name or "gls_" in name or "transmural_gradient" in name:
            continue
        assert value == pytest.approx(perfect, abs=1e-6, nan_ok=True), name


def test_peaks_are_those_of_the_first_beat(truth):
    """Of a clip of two beats the second, which contracts more, is found too late and too weak."""
    twice = np.concatenate([truth.displacement, 1.5 * truth.displacement])
    lines = replace(
        truth.contours, displacement=np.concatenate([truth.contours.displacement, rings(LATER).displacement])
    )
    given = {"displacement": twice, "contours": lines, "time": 3e-3 * np.arange(10)}
    both = replace(truth, strain=np.tile(truth.strain, (1, 2, 1, 1)), through_plane=np.zeros(twice.shape[:2]), **given)
    found = np.concatenate([truth.displacement, np.roll(truth.displacement, 1, 0)])
    errors = [score(tracked(each, found), each) for each in (both, replace(both, beat=5))]
    late, first = (error["time_to_peak_error"] for error in errors)
    np.testing.assert_allclose(first, 0, atol=1e-9)
    np.testing.assert_allclose(late, -15e-3, atol=1e-9)


@pytest.mark.parametrize("quantum", [0.0, 2.0**-24])
def test_a_rigid_shift_has_no_correlations_in_single_precision_or_rounded_to_a_quantum(truth, quantum):
    """Neither strain, nor motion out of the plane, nor the error differs between points but by rounding."""
    shift = np.arange(5)[:, None] * np.array([2.3e-4, -1.7e-4, 1.1e-4])
    lateral, axial, out = np.moveaxis(np.tile(shift[:, None], (len(truth.wall.layer), 1)), -1, 0)
    random = np.random.default_rng(0)
    step = quantum or np.spacing(np.float32(1e-3))
    rounding = step * random.uniform(-0.5, 0.5, (2, *out.shape, 2))
    moved = np.stack([lateral, axial], -1)
    operator = truth.operator.strain(moved + rounding[0])
    strain = np.stack([*random.normal(scale=5e-15, size=(2, *operator.shape)), operator])
    rigid = replace(truth, displacement=moved + rounding[0], through_plane=out + rounding[1, ..., 0], strain=strain)
    rigid = replace(rigid, quantum=quantum)
    shaky = moved + random.normal(scale=3e-6, size=moved.shape)
    for answer in (rigid.displacement, 1.1 * moved + rounding[1], shaky):
        found = score(tracked(truth, answer), rigid)
        assert np.isnan(found["strain_correlation"]).all() and np.isnan(found["segment_agreement"][:, 3]).all()
        assert np.isnan(found["through_plane_correlation"]) and np.isfinite(found["strain_rms"]).all()


def test_a_tracker_that_sees_nine_tenths_is_off_by_a_tenth(truth):
    found = metrics(score(tracked(truth, 0.9 * truth.displacement), truth), "short_axis")
    radius = np.hypot(*truth.wall.position.T)
    assert found["nrmse_percent"] == pytest.approx(10) and found["nrmse_cycle_percent"] == pytest.approx(10)
    assert found["rms_error_um"] == pytest.approx(1e6 * 0.01 * np.sqrt(np.mean(radius**2)))
    assert found["epe_um"] == pytest.approx(1e6 * 0.01 * radius.mean())
    assert found["epe_median_um"] == pytest.approx(1e6 * 0.01 * np.median(radius))
    assert found["drift_um"] == 0
    # Stretches of 0.91 instead of 0.90, in every direction.
    bias = 100 * (0.91**2 - 0.9**2) / 2
    for name in ("global_e_cc_bias_pp", "e_cc_rms_pp", "segment_e_rr_error_pp", "tracker_e_rr_rms_pp"):
        assert found[name] == pytest.approx(bias), name
    assert found["segment_e_cc_limits_pp"] == pytest.approx(0, abs=1e-9)
    # The ring is a tenth shorter, and the tracker sees nine hundredths.
    for name in ("gcs_bias_pp", "gcs_error_pp", "peak_strain_error_pp"):
        assert found[name] == pytest.approx(1, abs=2e-3), name
    assert found["time_to_peak_error_ms"] == 0 and found["rotation_error_deg"] == pytest.approx(0, abs=1e-9)


def test_long_axis_tells_the_longitudinal_strain_alone(truth):
    found = metrics(score(tracked(truth, 0.9 * truth.displacement), ventricle("long_axis")), "long_axis")
    assert np.isnan(found["gcs_error_pp"]) and found["gls_error_pp"] == pytest.approx(1, abs=2e-3)
    assert np.isnan(found["rotation_error_deg"])
    assert np.isnan(found["e_cc_rms_pp"]) and found["e_ll_rms_pp"] == pytest.approx(100 * (0.91**2 - 0.9**2) / 2)


def test_no_answer_is_an_error_of_all_there_is(truth):
    found = metrics(score(tracked(truth, np.nan * truth.displacement), truth), "short_axis")
    assert found["coverage_percent"] == 0 and found["nrmse_all_percent"] == pytest.approx(100)
    assert np.isnan(found["nrmse_percent"]) and np.isnan(found["e_cc_rms_pp"]) and np.isnan(found["epe_um"])
    assert np.isnan([found[name] for name in ("gcs_bias_pp", "time_to_peak_error_ms", "rotation_error_deg")]).all()


def test_leaving_points_out_does_not_pay(truth):
    moved = 0.9 * truth.displacement
    moved[:, ::2] = np.nan
    found = metrics(score(tracked(truth, moved), truth), "short_axis")
    squares = np.sum(truth.wall.position**2, axis=1)
    left_out = squares[::2].sum() / squares.sum()
    assert found["nrmse_percent"] == pytest.approx(10) and found["coverage_percent"] == pytest.approx(50, abs=0.1)
    assert found["nrmse_all_percent"] == pytest.approx(100 * np.sqrt(left_out + 0.01 * (1 - left_out)))


def test_drift_is_what_is_left_in_the_last_frame(truth):
    moved = truth.displacement + np.arange(5)[:, None, None] * np.array([3e-6, -4e-6])
    found = score(tracked(truth, moved), truth)
    assert found["drift"] == pytest.approx(20e-6)
    np.testing.assert_allclose(found["frame_rms_error"][:, -1], 5e-6 * np.arange(5), atol=1e-18)


def test_errors_that_grow_with_motion_out_of_the_plane_correlate_with_it(truth):
    out = np.random.default_rng(0).normal(size=truth.through_plane.shape) * 1e-4
    moved = truth.displacement + 0.3 * np.abs(out)[..., None] * np.array([0.6, 0.8])
    found = score(tracked(truth, moved), replace(truth, through_plane=out))
    assert found["through_plane_correlation"] == pytest.approx(1)
    at_es = truth.arrays["true_displacement"][truth.es][truth.inside]
    assert np.sqrt(np.mean(at_es[:, 2] ** 2)) == pytest.approx(1e-4 * np.sin(2))


def test_tracked_motion_is_scored_as_the_store_rounds_it(truth):
    quantum = 2.0**-20
    rounded = replace(truth, displacement=np.round(truth.displacement / quantum) * quantum, quantum=quantum)
    answer = 0.9 * truth.displacement
    exact, found = (score(tracked(truth, moved), rounded) for moved in (np.round(answer / quantum) * quantum, answer))
    assert all(np.array_equal(found[name], value, equal_nan=True) for name, value in exact.items())
    assert score(tracked(truth, rounded.displacement + 0.4 * quantum), rounded)["nrmse_all"] == 0


def test_maps_stand_on_the_grid_and_nowhere_else(truth):
    arrays = truth.arrays
    moved = arrays["true_displacement"]
    assert moved.shape == (5, 45, 45, 3)
    assert np.isfinite(moved[:, truth.inside]).all() and np.isnan(moved[:, ~truth.inside]).all()
    np.testing.assert_array_equal(moved[:, truth.inside, 2], truth.through_plane)
    assert arrays["true_strain"].shape == (3, 5, 45, 45, 3) and arrays["wall_axes"].shape == (45, 45, 2, 2)


@pytest.mark.parametrize("count", [0, 1, 5])
def test_a_grid_too_coarse_for_strain_still_has_an_error_of_displacement(truth, count):
    kept = np.arange(len(truth.wall.layer)) < count
    wall = replace(truth.wall, **{name: getattr(truth.wall, name)[kept] for name in ("position", "layer", "segment")})
    few = Truth(
        inside=truth.inside & (np.cumsum(truth.inside).reshape(truth.inside.shape) <= count),
        wall=wall,
        operator=StrainOperator(wall.position, truth.operator.axes[kept], truth.operator.radius),
        displacement=truth.displacement[:, kept],
        through_plane=truth.through_plane[:, kept],
        strain=truth.strain[:, :, kept],
        es=truth.es,
        contours=truth.contours,
        time=truth.time,
    )
    found = metrics(score(tracked(few, 0.9 * few.displacement), few), "short_axis")
    np.testing.assert_allclose(found["nrmse_percent"], 10 if count else np.nan)
    assert np.isnan(found["e_cc_rms_pp"]) and np.isnan(found["global_e_rr_bias_pp"])
    assert np.isnan(few.arrays["true_strain"]).sum() >= few.arrays["true_strain"].size - 3 * 5 * 3 * count

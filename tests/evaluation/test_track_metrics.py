"""Metrics of point tracks, of their steps, and of the quality that trackers state."""

import math

import numpy as np
import pandas as pd
import pytest

from benchmarks.suite.quality import calibration_error, curve
from echotruth.evaluation.point_tracks import flow_error, median_trajectory_error, survival, tap_vid
from echotruth.evaluation.reliability import counts, judged, summary

FRAMES, POINTS = 7, 40


@pytest.fixture(scope="module")
def tracks():
    """Errors of all sizes, some points without an estimate, and visible and claimed at random."""
    random = np.random.default_rng(3)
    error = np.exp(random.normal(1, 1.5, (FRAMES, POINTS)))
    error[random.random((FRAMES, POINTS)) < 0.1] = np.nan
    return error, random.random((FRAMES, POINTS)) < 0.7, random.random((FRAMES, POINTS)) < 0.6


def test_tap_vid_agrees_with_its_definition_written_out_point_by_point(tracks):
    error, visible, claimed = tracks
    delta, jaccard, rightly = [], [], 0
    for limit in (1, 2, 4, 8, 16):
        near = shown = true_positive = false_positive = 0
        for frame in range(1, FRAMES):
            for point in range(POINTS):
                is_near = not math.isnan(error[frame, point]) and error[frame, point] < limit
                shown += bool(visible[frame, point])
                near += bool(visible[frame, point]) and is_near
                if claimed[frame, point]:
                    hit = visible[frame, point] and is_near
                    true_positive, false_positive = true_positive + bool(hit), false_positive + (not hit)
        delta.append(100 * near / shown)
        jaccard.append(100 * true_positive / (shown + false_positive))
    for frame in range(1, FRAMES):
        rightly += sum(bool(a) == bool(b) for a, b in zip(visible[frame], claimed[frame], strict=True))
    found = tap_vid(error, visible, claimed)
    assert [found[f"delta_{limit}_percent"] for limit in (1, 2, 4, 8, 16)] == pytest.approx(delta)
    assert found["delta_avg_percent"] == pytest.approx(sum(delta) / 5)
    assert found["average_jaccard_percent"] == pytest.approx(sum(jaccard) / 5)
    assert found["occlusion_accuracy_percent"] == pytest.approx(100 * rightly / ((FRAMES - 1) * POINTS))


def test_a_tracker_that_is_three_pixels_off_is_right_within_four_eight_and_sixteen():
    everywhere = np.ones((5, 2), bool)
    found = tap_vid(np.full((5, 2), 3.0), everywhere, everywhere)
    assert [found[f"delta_{limit}_percent"] for limit in (1, 2, 4, 8, 16)] == [0, 0, 100, 100, 100]
    # Where it is wrong, each claim is a false positive beside each point that is missed.
    assert found["average_jaccard_percent"] == found["delta_avg_percent"] == 60
    edge = tap_vid(np.full((5, 2), 4.0), everywhere, everywhere)
    assert edge["delta_4_percent"] == 0 and edge["delta_8_percent"] == 100


def test_a_perfect_path_of_hidden_tissue_is_right_only_if_the_tracker_says_that_it_is_hidden():
    error, hidden = np.zeros((3, 4)), np.zeros((3, 4), bool)
    hidden[:, :2] = True
    silent, loud = (tap_vid(error, ~hidden, claimed) for claimed in (~hidden, np.ones((3, 4), bool)))
    assert silent["average_jaccard_percent"] == silent["occlusion_accuracy_percent"] == 100
    assert loud["average_jaccard_percent"] == pytest.approx(50) and loud["occlusion_accuracy_percent"] == 50
    assert loud["delta_avg_percent"] == loud["delta_all_avg_percent"] == 100 and loud["visible_percent"] == 50


def test_the_frame_in_which_points_are_given_does_not_count():
    error, everywhere = np.array([[0.0], [20.0]]), np.ones((2, 1), bool)
    assert tap_vid(error, everywhere, everywhere)["delta_16_percent"] == 0
    assert median_trajectory_error(error) == 20 and survival(error, 10) == 0


def test_no_visible_point_has_no_delta():
    found = tap_vid(np.zeros((3, 2)), np.zeros((3, 2), bool), np.zeros((3, 2), bool))
    assert math.isnan(found["delta_avg_percent"]) and found["occlusion_accuracy_percent"] == 100


def test_trajectory_error_is_the_mean_over_tracks_of_the_median_over_frames():
    error = np.array([[0.0, 0.0], [1.0, 5.0], [2.0, 5.0], [90.0, 8.0]])
    assert median_trajectory_error(error) == pytest.approx((2 + 5) / 2)


def test_a_lost_track_stays_lost():
    error = np.array([[0.0, 0.0, 0.0], [9.0, 1.0, np.nan], [1.0, 1.0, 1.0], [1.0, 9.0, 1.0], [1.0, 1.0, 1.0]])
    assert survival(error, 8.0) == pytest.approx(100 * (0 + 2 + 0) / 12)


def test_errors_of_flow_agree_with_their_definition_written_out_step_by_step():
    random = np.random.default_rng(4)
    tracked, true = np.cumsum(random.normal(0, 2, (2, FRAMES, POINTS, 2)), axis=1)
    tracked[3, 5] = np.nan
    lengths, angles = [], []
    for frame in range(FRAMES - 1):
        for point in range(POINTS):
            u, v = tracked[frame + 1, point] - tracked[frame, point]
            x, y = true[frame + 1, point] - true[frame, point]
            if not math.isnan(u):
                lengths.append(math.sqrt((u - x) ** 2 + (v - y) ** 2))
                cosine = (1 + u * x + v * y) / math.sqrt((1 + u * u + v * v) * (1 + x * x + y * y))
                angles.append(math.degrees(math.acos(cosine)))
    found = flow_error(tracked, true)
    assert found["flow_epe_px256"] == pytest.approx(np.mean(lengths))
    assert found["flow_angular_error_deg"] == pytest.approx(np.mean(angles))


@pytest.mark.parametrize("angle_deg", [1e-6, 0.5, 30.0, 60.0])
def test_a_step_that_is_not_seen_is_off_by_its_angle_in_space_and_time(angle_deg):
    step = math.tan(math.radians(angle_deg))
    true = np.array([[[0.0, 0.0]], [[0.6 * step, 0.8 * step]]])
    found = flow_error(np.zeros((2, 1, 2)), true)
    assert found["flow_angular_error_deg"] == pytest.approx(angle_deg, rel=1e-9)
    assert found["flow_epe_px256"] == pytest.approx(step)


def test_a_constant_offset_costs_no_flow():
    true = np.random.default_rng(0).normal(0, 1, (4, 3, 2))
    assert flow_error(true + [3.0, -1.0], true)["flow_epe_px256"] == pytest.approx(0, abs=1e-12)
    assert math.isnan(flow_error(np.full((4, 3, 2), np.nan), true)["flow_epe_px256"])


def test_quality_that_is_the_probability_of_being_right_is_calibrated_and_half_of_it_is_not():
    random = np.random.default_rng(2)
    quality = random.random(200_000)
    within = random.random(200_000) < quality
    true, half = summary(quality, within), summary(quality / 2, within)
    assert true["calibration_error_percent"] < 1 and true["quality_percent"] == pytest.approx(50, abs=0.5)
    # Of a uniform quality q, E[q (1 - q)] is 1/6, and half of it is wrong by q / 2, in the mean 25 %.
    assert true["brier_score"] == pytest.approx(1 / 6, abs=2e-3)
    assert half["calibration_error_percent"] == pytest.approx(25, abs=0.5)


def test_expected_calibration_error_agrees_with_its_definition_written_out():
    random = np.random.default_rng(6)
    quality, within = random.random(500) ** 2, random.random(500) < 0.4
    expected = 0.0
    for k in range(10):
        members = [i for i in range(500) if k <= 10 * quality[i] < k + 1]
        if members:
            stated, right = (sum(values[i] for i in members) / len(members) for values in (quality, within))
            expected += len(members) / 500 * abs(stated - right)
    table = pd.DataFrame(counts(quality, within))
    assert calibration_error(table) == pytest.approx(100 * expected)
    # Two halves of the points, as two clips, add up to the same.
    halves = [pd.DataFrame(counts(quality[k::2], within[k::2])) for k in (0, 1)]
    assert calibration_error(pd.concat(halves)) == pytest.approx(100 * expected)


def test_points_without_an_estimate_have_quality_zero_and_the_surest_are_in_the_last_step():
    table = pd.DataFrame(counts(np.array([np.nan, 1.0, 0.95, 0.1]), np.array([False, True, False, True])))
    assert list(table["count"]) == [1, 1, 0, 0, 0, 0, 0, 0, 0, 2]
    found = curve(table.assign(size_px=512, tracker="a")).set_index("quality_low")
    assert found.loc[0.9, "observed_percent"] == 50 and found.loc[0.9, "stated_percent"] == pytest.approx(97.5)
    assert math.isnan(found.loc[0.5, "observed_percent"])


def test_tracker_that_states_no_quality_is_not_judged_by_it_and_one_that_failed_is_sure_of_nothing():
    unknown, wrong = np.full((FRAMES, POINTS), np.nan), np.zeros((FRAMES, POINTS), bool)
    frames = judged(unknown, np.zeros((FRAMES, POINTS, 2)))
    assert all(np.isnan(value) for value in summary(unknown[frames], wrong[frames]).values())
    assert sum(step["count"] for step in counts(unknown[frames], wrong[frames])) == 0
    frames = judged(unknown, np.full((FRAMES, POINTS, 2), np.nan))
    assert summary(unknown[frames], wrong[frames])["quality_percent"] == 0
    assert sum(step["count"] for step in counts(unknown[frames], wrong[frames])) == (FRAMES - 1) * POINTS

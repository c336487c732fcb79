"""What is read off the curves of segments, and which of them are infarcted."""

import numpy as np
import pytest

from echotruth.evaluation.segment_strain import Tissue, errors, segment_rows

TIME = np.linspace(0, 0.1, 11)
COURSE = np.sin(np.pi * TIME / 0.1)


def tissue(region=0):
    """Segments 7 to 9 with two layers of ten points each."""
    segment, layer = np.repeat([7, 8, 9], 20), np.tile(np.repeat([1, 2], 10), 3)
    return Tissue(layer, segment, np.broadcast_to(region, 60), 2)


def curves(peaks, shift=0):
    """Curves of all segments, shifted by frames; shortening by each peak in segments 7 to 9."""
    strain = np.full((len(TIME), 17, 3), np.nan)
    strain[:, 6:9, 1] = np.multiply.outer(np.roll(COURSE, shift), peaks)
    strain[:, 6:9, 0] = -2 * strain[:, 6:9, 1]
    return strain


def test_shares_of_infarct_are_those_of_all_points_and_of_the_inner_and_the_outer_layer():
    region = np.zeros(60, int)
    region[:10] = 1  # the inner layer of segment 7
    region[20:35] = 1  # the inner and half of the outer layer of segment 8
    region[40:60] = 2  # border zone is no infarct
    found = tissue(region).rows()
    shares = {
        aha: [row[name] for name in ("infarct_share", "infarct_extent", "epicardial_share")]
        for aha, row in found.items()
    }
    assert shares == {7: [0.5, 1, 0], 8: [0.75, 1, 0.5], 9: [0, 0, 0]}
    assert [row["points"] for row in found.values()] == [20, 20, 20]


def test_a_segment_without_a_point_in_its_inner_layer_has_the_share_of_all_its_points():
    found = Tissue(np.array([2, 2]), np.array([7, 7]), np.array([1, 0]), 3).rows()
    assert found[7]["infarct_extent"] == found[7]["epicardial_share"] == 0.5


def test_points_outside_the_wall_belong_to_no_segment():
    assert Tissue(np.array([0, 1]), np.array([7, 0]), np.array([1, 1]), 3).rows() == {}


def test_errors_of_segments_are_means_of_absolute_differences():
    rows = segment_rows(curves([-0.18, -0.22, -0.2]), curves([-0.2, -0.2, -0.2]), tissue(), "short_axis", TIME, es=5)
    assert {row["component"] for row in rows} == {"radial", "circumferential"} and len(rows) == 6
    found = errors(rows)
    assert found["segment_peak_bias_pp"] == pytest.approx(0, abs=1e-9)
    assert found["segment_peak_error_pp"] == pytest.approx(4 / 3) and found["segment_time_to_peak_error_ms"] == 0
    # Shortening is fastest at the start; the second-order slope there is (4 sin(18) - sin(36)) / 20 ms.
    slope = (4 * np.sin(np.pi / 10) - np.sin(np.pi / 5)) / 0.02
    assert found["segment_strain_rate_error_per_s"] == pytest.approx(slope * 0.04 / 3)


def test_time_to_peak_of_a_segment_that_hardly_moves_does_not_count():
    true = curves([-0.2, -0.2, -0.01])
    late = curves([-0.2, -0.2, -0.01], shift=2)
    late[:, 6:8] = curves([-0.2, -0.2, -0.01], shift=1)[:, 6:8]
    found = errors(segment_rows(late, true, tissue(), "long_axis", TIME, es=5))
    assert found["segment_time_to_peak_error_ms"] == pytest.approx(10)


def test_segments_without_an_estimate_have_no_error():
    found = errors(segment_rows(curves([np.nan] * 3), curves([-0.2] * 3), tissue(), "short_axis", TIME, es=5))
    assert all(np.isnan(value) for value in found.values())


def test_the_peak_is_that_of_contraction_where_a_segment_is_stretched_first_and_more():
    stretched = curves([-0.1, -0.1, 0.3])
    stretched[7:, 8] = [[0.02, -0.01, np.nan], [0.05, -0.04, np.nan], [0.03, -0.02, np.nan], [0, 0, np.nan]]
    rows = segment_rows(stretched, stretched, tissue(), "short_axis", TIME, es=5)
    last = {row["component"]: row for row in rows if row["aha"] == 9}
    assert last["circumferential"]["true_peak_percent"] == pytest.approx(-4)
    assert last["radial"]["true_peak_percent"] == pytest.approx(5)
    assert last["circumferential"]["true_time_to_peak_ms"] == pytest.approx(80)


def test_a_segment_that_is_only_stretched_has_no_peak_and_no_time_of_it():
    rows = segment_rows(curves([0.1] * 3), curves([0.1] * 3), tissue(), "short_axis", TIME, es=5)
    assert {row["true_peak_percent"] for row in rows} == {0} and np.isnan(
        [row["true_time_to_peak_ms"] for row in rows]
    ).all()


def test_rates_of_a_stretched_segment_are_those_of_stretch_also_where_the_tracked_one_ends_up_shortened():
    true, tracked = curves([0.0] * 3), curves([0.0] * 3)
    true[:, 7, 1] = [0, 0.02, 0.04, *[0.05] * 8]
    tracked[:, 7, 1] = [0, 0.01, 0.02, 0.01, *[-0.01] * 7]
    rows = segment_rows(tracked, true, tissue(), "short_axis", TIME, es=4)
    (row,) = (row for row in rows if row["aha"] == 8 and row["component"] == "circumferential")
    # Differences over 20 ms: 0.04 and, of the tracked one, 0.02 at first; it shortens by 0.03 later on.
    assert row["true_systolic_rate_per_s"] == pytest.approx(2.0)
    assert row["tracked_systolic_rate_per_s"] == pytest.approx(1.0)
    assert errors([row])["segment_strain_rate_error_per_s"] == pytest.approx(1.0)


def test_a_corner_of_a_segment_has_a_row_and_does_not_count_in_the_errors_of_the_clip():
    corner = Tissue(np.ones(41, int), np.repeat([7, 8, 9], [20, 20, 1]), np.zeros(41, int), 1)
    rows = segment_rows(curves([-0.2, -0.2, -0.05]), curves([-0.2, -0.2, -0.2]), corner, "short_axis", TIME, es=5)
    assert [row["points"] for row in rows if row["component"] == "circumferential"] == [20, 20, 1]
    assert errors(rows)["segment_peak_error_pp"] == pytest.approx(0, abs=1e-9)

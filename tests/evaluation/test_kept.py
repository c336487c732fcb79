"""Displacement and curves of a tracker from outside, stored beside those of the repository."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import zarr
from finished_repository import made_otherwise
from known_repository import SETTINGS, make

import echotruth as et
from benchmarks.suite.quality import calibration_error, curve
from echotruth.evaluation.run import prepare

pytestmark = pytest.mark.slow

TRACKER = """
import numpy as np

def steps(frames, points, mask, spacing, frame_time, seed):
    course = np.arange(len(frames))[:, None, None]
    return course * np.array([1.0, -2.0]) * np.ones((1, len(points), 2)), np.full((len(frames), len(points)), 0.5)

def large_only(frames, points, mask, spacing, frame_time, seed):
    if frames.shape[-1] < 128:
        raise MemoryError("no room")
    return steps(frames, points, mask, spacing, frame_time, seed)
"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A repository of one heart that moves as a rigid body, at two image sizes."""
    folder = tmp_path_factory.mktemp("kept") / "known"
    return make(folder, SETTINGS | {"tracking": SETTINGS["tracking"] | {"grid": 0.016}}).folder


@pytest.fixture
def repository(finished, tmp_path, monkeypatch):
    """A copy of it, where the trackers are."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    Path("mine.py").write_text(TRACKER)
    return Path(shutil.copytree(finished, tmp_path / "known"))


def evaluate(folder, function="steps", sizes=(), views=(), keep=True):
    run = prepare(et.Repository(folder), "mine", {"method": "external", "track": f"mine:{function}"}, keep)
    case_views, sizes = run.case_views([], list(views)), run.sizes(list(sizes))
    run.check_writable()
    return run.write(list(run.rows(case_views, sizes)))


def test_kept_displacement_is_what_the_tracker_returned_in_metres_on_the_grid(repository):
    evaluate(repository)
    for size in (128, 64):
        found = et.Repository(repository).tracks(view="mid", trackers=["mine"], size=size)
        of_tracker = found.isel(tracker=0)
        spacing = 12e-3 / size
        inside = found["layer"].values > 0
        assert inside.any() and np.isnan(of_tracker["displacement"].values[:, ~inside]).all()
        moved = of_tracker["displacement"].values[:, inside]
        expected = np.arange(3)[:, None, None] * np.array([1, -2]) * spacing * np.ones((1, inside.sum(), 1))
        np.testing.assert_allclose(moved, expected, atol=1e-6)
        np.testing.assert_array_equal(of_tracker["quality"].values[:, inside], 0.5)
        assert list(found["tracker"]) == ["mine"]


def test_kept_curves_are_read_like_those_of_the_repository(repository):
    evaluate(repository)
    mine, own = (et.Repository(repository).curves(view="mid", tracker=name, size=64) for name in ("mine", "two"))
    assert set(mine) == set(own) and mine.sizes == own.sizes
    np.testing.assert_array_equal(mine["true_line_strain"], own["true_line_strain"])
    # A tracker that shifts all points alike finds neither strain nor rotation, where there are points enough to say so.
    for name in ("tracked_region_strain", "tracked_rotation", "tracked_line_strain"):
        seen = mine[name].values[np.isfinite(mine[name].values)]
        np.testing.assert_allclose(seen, 0, atol=1e-4)
    table = et.Repository(repository).summary(trackers=["mine"])
    assert set(table["tracker"]) == {"mine"} and set(table["view"]) == {"mid", "long", "all"}


def test_what_was_not_evaluated_is_unknown_or_refused(repository):
    evaluate(repository, sizes=[128], views=["mid"])
    with pytest.raises(ValueError, match=r"^tracker = 'mine': it was not evaluated on heart mid\.$"):
        et.Repository(repository).tracks(view="mid", trackers=["mine"], size=64)
    with pytest.raises(ValueError, match=r"^tracker = 'mine': it was not evaluated on heart long\.$"):
        et.Repository(repository).curves(view="long", tracker="mine")
    table = et.Repository(repository).summary()
    assert set(table.loc[table["tracker"] == "mine", "view"]) == {"mid", "all"}


def test_size_at_which_the_tracker_failed_is_unknown_and_the_other_is_there(repository):
    table = evaluate(repository, "large_only", views=["mid"])
    assert list(table["failure"] != "") == [False, True]
    large, small = (et.Repository(repository).tracks(view="mid", trackers=["mine"], size=size) for size in (128, 64))
    assert np.isfinite(large["displacement"]).any() and np.isnan(small["displacement"]).all()


def test_images_made_anew_are_not_those_that_were_tracked(repository):
    evaluate(repository)
    made_otherwise(repository / "known.zarr/clips/heart/mid/bmode/128")
    with pytest.raises(ValueError, match=r"^tracker = 'mine': it was evaluated on older images, or .*, of heart mid"):
        et.Repository(repository).tracks(view="mid", trackers=["mine"])
    assert et.Repository(repository).tracks(view="long", trackers=["mine"]) is not None


def test_points_of_another_grid_are_not_those_that_were_tracked(repository):
    evaluate(repository, views=["mid"])
    path = repository / "config.yaml"
    path.write_text(path.read_text().replace("grid: 0.016", "grid: 0.03"))
    with pytest.raises(ValueError, match=r"^tracker = 'mine': it was evaluated on .* other points, of heart mid"):
        et.Repository(repository).tracks(view="mid", trackers=["mine"])


def left(folder):
    """What is in the folder of trackers from outside."""
    return sorted(path.name for path in (folder / "external").iterdir())


def test_later_evaluation_replaces_what_was_kept_and_one_that_keeps_nothing_removes_it(repository):
    evaluate(repository)
    evaluate(repository, views=["mid"])
    with pytest.raises(ValueError, match="not evaluated on heart long"):
        et.Repository(repository).tracks(view="long", trackers=["mine"])
    assert left(repository) == ["mine.csv", "mine.zarr"]
    evaluate(repository, keep=False)
    assert left(repository) == ["mine.csv"]
    assert len(pd.read_csv(repository / "external/mine.csv")) == 4


def test_evaluation_that_is_broken_off_leaves_what_was_kept_before(repository):
    evaluate(repository, views=["mid"])
    run = prepare(et.Repository(repository), "mine", {"method": "external", "track": "mine:steps"}, keep=True)
    run.check_writable()
    rows = run.rows(run.case_views([], []), run.sizes([]))
    list(rows)
    assert et.Repository(repository).trackers == ["one", "two", "mine"]
    with pytest.raises(ValueError, match="not evaluated on heart long"):
        et.Repository(repository).tracks(view="long", trackers=["mine"])
    assert np.isfinite(et.Repository(repository).tracks(view="mid", trackers=["mine"])["displacement"]).any()


def px256(clips, tracker, view="mid"):
    """Metrics of one tracker by size."""
    return clips[(clips["tracker"] == tracker) & (clips["view"] == view)].set_index("size_px")


def test_metrics_of_tracks_are_those_of_displacements_that_are_known(repository):
    evaluate(repository, views=["mid"])
    found = et.Repository(repository).metrics()
    assert len(found.clips) == 2 * 2 * 2 + 2 and set(found.clips["heart"]) == {"heart"}
    # The truth of this repository does not move; tracker one is off by 0.1 mm both ways, 3.02 px of 256 in 12 mm.
    one, two, mine = (px256(found.clips, name) for name in ("one", "two", "mine"))
    assert list(one["delta_2_percent"]) == [0, 0] and list(one["delta_avg_percent"]) == [60, 60]
    assert list(two["delta_avg_percent"]) == [40, 40] and list(one["flow_epe_px256"]) == [0, 0]
    # Stored displacements are rounded to 1/256 pixel of 2 px.
    assert one["median_trajectory_error_px256"].tolist() == pytest.approx(
        [2**0.5 * 0.1e-3 * 256 / 12e-3] * 2, abs=0.006
    )
    # Mine moves by (1, -2) px a frame, 2 px of 256 wide at 128 and 4 at 64.
    step = 5**0.5 * np.array([2, 4])
    np.testing.assert_allclose(mine["flow_epe_px256"], step, rtol=1e-3)
    np.testing.assert_allclose(mine["median_trajectory_error_px256"], 1.5 * step, rtol=1e-3)
    np.testing.assert_allclose(mine["flow_angular_error_deg"], np.degrees(np.arctan(step)), rtol=1e-3)
    assert list(mine["delta_16_percent"]) == [100, 50] and list(mine["survival_8px_percent"]) == [50, 0]
    assert list(mine["visible_percent"]) == [100, 100] and list(mine["occlusion_accuracy_percent"]) == [100, 100]
    assert list(one["occlusion_accuracy_percent"]) == [0, 0]  # its quality is 0
    sure = found.reliability[found.reliability["count"] > 0].set_index(["tracker", "size_px", "view"])
    row = sure.loc[("mine", 128, "mid"), ["quality_low", "count", "within_count"]]
    assert list(row) == [0.5, 2 * mine.loc[128, "points"], 0]


def test_tissue_that_leaves_the_slice_is_hidden_and_a_tracker_that_is_sure_of_it_is_wrong(repository):
    evaluate(repository, views=["mid"])
    array = zarr.open_array(repository / "known.zarr/clips/heart/mid/tracking/128/true_displacement")
    # The slice is some 0.36 mm thick.
    array[..., 2] = np.array([0, 0.1e-3, 1e-3])[:, None, None]
    clips = px256(et.Repository(repository).metrics(views=["mid"]).clips, "mine")
    assert list(clips["visible_percent"]) == list(clips["occlusion_accuracy_percent"]) == [50, 50]
    # In the frame in which it is seen it is off by 4.5 px, afterwards by 8.9; the latter claim is false anyhow.
    assert clips.loc[128, "delta_avg_percent"] == 40 and clips.loc[128, "delta_all_avg_percent"] == 30
    assert clips.loc[128, "average_jaccard_percent"] == pytest.approx(100 * 2 / 5 * 1 / 2)
    assert clips.loc[128, "through_plane_rms_um"] == pytest.approx(1000, abs=0.5)  # end-systole is the last frame


def test_metrics_of_a_tracker_that_was_not_kept_are_those_of_its_scores(repository):
    scores = evaluate(repository, keep=False).set_index(["view", "size_px"])
    clips = et.Repository(repository).metrics(trackers=["mine"]).clips.set_index(["view", "size_px"])
    np.testing.assert_allclose(clips["nrmse_all_percent"], scores.loc[clips.index, "nrmse_all_percent"])
    assert len(clips) == 4 and (clips["failure"] == "").all() and (clips["points"] > 0).all()
    everything = et.Repository(repository).metrics().clips
    assert everything.loc[everything["tracker"] == "mine", "delta_avg_percent"].isna().all()


def test_tables_without_a_row_have_their_columns_and_nothing_to_say(repository):
    evaluate(repository, keep=False)
    full, empty = et.Repository(repository).metrics(), et.Repository(repository).metrics(trackers=["mine"])
    assert list(empty.segments) == list(full.segments) and list(empty.reliability) == list(full.reliability)
    assert empty.segments.empty
    assert curve(empty.reliability).empty and list(curve(empty.reliability)) == list(curve(full.reliability))
    assert np.isnan(calibration_error(empty.reliability))


def test_metrics_of_a_failed_clip_are_the_worst_or_unknown_and_its_reason_is_told(repository):
    evaluate(repository, "large_only", views=["mid"])
    small = px256(et.Repository(repository).metrics().clips, "mine").loc[64]
    assert "no room" in small["failure"] and small["nrmse_all_percent"] == 100
    assert small["delta_avg_percent"] == 0 and small["survival_percent"] == 0 and small["quality_percent"] == 0
    assert np.isnan(small["tracked_gcs_percent"]) and np.isnan(small["segment_peak_error_pp"])


def test_clips_that_are_not_evaluated_yet_have_no_metrics(repository):
    (repository / "known.zarr/clips/heart/long/tracking/128/zarr.json").unlink()
    assert set(et.Repository(repository).metrics().clips["view"]) == {"mid"}
    assert et.Repository(repository).metrics(views=["long"]).clips.empty
    with pytest.raises(ValueError, match=r"^tracker = 'other': use one of one, two\.$"):
        et.Repository(repository).metrics(trackers=["other"])

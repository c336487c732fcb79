"""The evaluator of a release needs NumPy alone, and finds the scores of the leaderboard."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

import echotruth as et
from echotruth.sharing.release import evaluate
from echotruth.sharing.release.clips import clips_of

METRICS = {
    "nrmse_percent",
    "nrmse_all_percent",
    "nrmse_cycle_percent",
    "epe_um",
    "epe_median_um",
    "drift_um",
    "coverage_percent",
}


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Path of a clip of the shipped repository."""
    (name, content), *_ = clips_of(et.sample(), "infarct", "mid").items()
    path = tmp_path_factory.mktemp("clips") / name
    path.write_bytes(content)
    return path


def tracked(tracker):
    """What a tracker found at the points of that clip, px."""
    found = et.sample().tracks("infarct", "mid", trackers=[tracker])["displacement"].isel(tracker=0)
    inside = np.isfinite(et.sample().tracks("infarct", "mid")["true_displacement"].values[0, ..., 0])
    return found.values[:, inside] / (et.sample().config.bmode.si().field_of_view / 256)


@pytest.mark.parametrize("tracker", ["dis", "bspline_dic"])
def test_scores_are_those_of_the_repository(clip, tracker, tmp_path):
    np.savez(tmp_path / "tracked.npz", displacement=tracked(tracker))
    # Isolated: it finds neither echotruth nor a file beside it.
    script = shutil.copy(evaluate.__file__, tmp_path / "evaluate.py")
    command = [sys.executable, "-I", script, clip, tmp_path / "tracked.npz"]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    (row,) = et.sample().scores.query("case == 'infarct' and view == 'mid' and tracker == @tracker").to_dict("records")
    assert found.keys() == METRICS
    assert found == {name: pytest.approx(row[name], rel=1e-5) for name in METRICS}


def test_points_without_an_estimate_count_as_at_rest_or_not_at_all():
    true = np.zeros((3, 4, 2))
    true[1, :, 0] = 2.0
    found = true + [0.0, 1.0]
    found[:, 0] = np.nan
    errors = evaluate.evaluate(found, true, 1e-3, 1)
    assert errors["nrmse_percent"] == pytest.approx(50)
    assert errors["nrmse_all_percent"] == pytest.approx(100 * np.sqrt((3 * 1 + 4) / 16))
    assert errors["epe_um"] == errors["drift_um"] == pytest.approx(1000)
    assert errors["coverage_percent"] == 75


def test_wrong_files_are_told_in_one_sentence(clip, tmp_path, capsys):
    np.savez(tmp_path / "few.npz", displacement=np.zeros((2, 3, 2)))
    np.savez(tmp_path / "other.npz", motion=np.zeros((2, 3, 2)))
    (tmp_path / "text.npz").write_text("no archive")
    for name in ("few", "other", "text", "absent"):
        with pytest.raises(SystemExit) as ended:
            evaluate.main(clip, tmp_path / f"{name}.npz")
        assert str(ended.value).startswith("evaluate.py: ") and f"{name}.npz" in str(ended.value)


def test_clip_has_what_a_tracker_is_given(clip):
    with np.load(clip, allow_pickle=False) as found:
        frames, points, mask, true = (found[name] for name in ("frames", "points", "mask", "displacement"))
    whole = et.sample().clip("infarct", "mid")
    np.testing.assert_array_equal(frames, whole["image"].values)
    np.testing.assert_array_equal(mask, whole["mask"].isel(frame=0).values)
    column, row = np.round(points).astype(int).T
    pixel = float(whole["axial"][1] - whole["axial"][0])
    at = whole["displacement"].sel(vector=["lateral", "axial"]).values[0, row, column]
    assert np.isfinite(true).all() and mask[row, column].all() and np.abs(at).max() == 0
    # The points are pixels of the largest image, so that they are where the flow of frame 0 begins.
    following = whole["flow"].sel(to="next", vector=["lateral", "axial"]).values[0, row, column] / pixel
    np.testing.assert_allclose(true[1], following, atol=0.01)

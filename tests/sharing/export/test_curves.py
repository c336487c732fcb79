"""Curves as CSV, read by pandas."""

import shutil

import numpy as np
import pandas as pd
import pytest
from known_repository import FRAMES, SHIFT

from echotruth.repository.reader import Repository
from echotruth.sharing.export import Export


@pytest.fixture(scope="module")
def table(exported_once):
    return pd.read_csv(exported_once("csv"), keep_default_na=False, na_values={"tracked": "", "true": ""})


def curve(table, quantity, place="", component="", measure="", tracker=""):
    """Rows of one curve, one a frame."""
    keys = {"quantity": quantity, "place": place, "component": component, "measure": measure, "tracker": tracker}
    found = table[(table[list(keys)] == pd.Series(keys)).all(axis=1)]
    assert found["frame"].tolist() == list(range(FRAMES))
    return found


@pytest.mark.slow
def test_every_curve_has_one_row_a_frame_at_its_time(table):
    keys = ["tracker", "quantity", "measure", "place", "component"]
    assert (table.groupby(keys).size() == FRAMES).all() and not table[[*keys, "frame"]].duplicated().any()
    np.testing.assert_allclose(table["time_ms"], 120 / FRAMES * table["frame"])


def test_shift_along_the_long_axis_is_the_motion_of_apex_and_base(table):
    expected = 1e6 * SHIFT[2] * np.linspace(0, 1, FRAMES)
    for name in ("apex_motion", "base_motion"):
        found = curve(table, name)
        np.testing.assert_allclose(found["true"], expected, atol=1e-6)
        assert set(found["unit"]) == {"um"}


def test_rigid_body_neither_strains_nor_twists_and_has_no_pressure(table):
    found = table[table["quantity"].isin(["heart_strain", "twist", "rotation_base", "rotation_apex"])]
    assert len(found) == FRAMES * (3 + 17 * 3 + 3)
    seen = found["true"].dropna()
    np.testing.assert_allclose(seen, 0, atol=1e-4)
    assert len(seen) > 40 * FRAMES and curve(table, "pressure")["true"].isna().all()


def test_trackers_stand_beside_the_truth_in_the_plane_in_both_measures(table):
    """Strain in percent, angles in degrees; the truth is the second reference, and one for all trackers."""
    for tracker, value in (("one", 10), ("two", 20)):
        for measure in ("engineering", "green_lagrange"):
            wall = curve(table, "region_strain", "wall", "RR", measure, tracker)
            np.testing.assert_allclose(wall[["tracked", "true"]], [[value, 40]] * FRAMES)
            segment = curve(table, "segment_strain", "segment_07", "TT", measure, tracker)
            np.testing.assert_allclose(segment[["tracked", "true"]], [[value + 1, 41]] * FRAMES)
        assert set(curve(table, "region_strain", "layer_6", "RT", "green_lagrange", tracker)["unit"]) == {"percent"}
        shear = curve(table, "region_strain", "layer_6", "RT", "engineering", tracker)
        np.testing.assert_allclose(shear["tracked"], np.degrees(value / 100))
        line = curve(table, "line_strain", "middle", "", "engineering", tracker)
        np.testing.assert_allclose(line[["tracked", "true"]], [[-value - 2, -14]] * FRAMES)
        turned = curve(table, "rotation", tracker=tracker)
        np.testing.assert_allclose(turned[["tracked", "true"]], np.degrees([[value / 100 + 0.03, 0.15]] * FRAMES))


def test_only_chosen_trackers_have_rows(known, tmp_path):
    work = Export(Repository(known.folder), "csv", views=["mid"], trackers=["two"], output=tmp_path)
    (file,) = work.write(work.clips()[0])
    assert set(pd.read_csv(file, keep_default_na=False)["tracker"]) == {"", "two"}


def test_tracker_that_was_run_on_one_view_has_rows_of_that_alone(known, tmp_path):
    folder = shutil.copytree(known.folder, tmp_path / known.folder.name)
    (tracked,) = folder.glob("*.zarr/clips/*/long/tracking/two")
    shutil.rmtree(tracked)
    work = Export(Repository(folder), "csv", output=tmp_path / "csv")
    tables = {file.stem: pd.read_csv(file, keep_default_na=False) for file in work.write(work.clips()[0])}
    found = {name: set(table["tracker"]) for name, table in tables.items()}
    assert {"two" in trackers for name, trackers in found.items() if "long" in name} == {False}
    assert {"two" in trackers for name, trackers in found.items() if "mid" in name} == {True}


def test_summary_of_all_clips_stands_beside_their_curves(known, tmp_path):
    work = Export(Repository(known.folder), "csv", trackers=["two"], output=tmp_path)
    files = list(work.write(work.clips()[0]))
    table = pd.read_csv(tmp_path / "summary.csv")
    assert {file.name for file in files} == {path.name for path in tmp_path.iterdir()} - {"summary.csv"}
    found = table.set_index(["view", "quantity"])
    np.testing.assert_allclose(found.loc[("mid", "gcs"), ["tracked_es", "true_es"]].astype(float), [-22, -14])
    np.testing.assert_allclose(found.loc[("long", "gls"), ["tracked_peak", "true_peak"]].astype(float), [-22, -14])
    np.testing.assert_allclose(found.loc[("all", "radial"), ["tracked_es", "true_es"]].astype(float), [20, 40])
    assert ("long", "gcs") not in found.index and ("all", "twist") not in found.index


def test_one_file_has_no_table_beside_it(known, tmp_path):
    chosen = {"views": ["mid"], "trackers": ["two"]}
    work = Export(Repository(known.folder), "csv", **chosen, output=tmp_path / "mine.csv")
    assert list(work.write(work.clips()[0])) == [tmp_path / "mine.csv"] == list(tmp_path.iterdir())

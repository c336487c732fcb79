"""Curves as CSV, read by pandas."""

import csv

import numpy as np
import pandas as pd
import pytest
from known_repository import FRAMES, SHIFT

from echotruth.export import Export, Selection, source


@pytest.fixture
def table(exported):
    return pd.read_csv(exported("csv"))


def test_one_row_a_frame_at_its_time(table):
    assert table["frame"].tolist() == list(range(FRAMES))
    np.testing.assert_allclose(table["time_ms"], 120 / FRAMES * np.arange(FRAMES))


def test_shift_along_the_long_axis_is_the_motion_of_apex_and_base(table):
    expected = 1e6 * SHIFT[2] * np.linspace(0, 1, FRAMES)
    np.testing.assert_allclose(table["apex_motion_um"], expected, atol=1e-6)
    np.testing.assert_allclose(table["base_motion_um"], expected, atol=1e-6)


def test_rigid_body_neither_strains_nor_twists_and_has_no_pressure(table):
    names = [name for name in table if name.startswith(("strain_", "segment_")) or name.endswith("_deg")]
    assert len(names) == 3 + 17 * 3 + 3
    seen = table[names].dropna(axis=1, how="all")
    np.testing.assert_allclose(seen, 0, atol=1e-4)
    assert seen.shape[1] > 40 and table["pressure_kPa"].isna().all()


def test_trackers_and_references_are_told_apart(table):
    """In percent; the truth is the first reference, the heart."""
    for tracker, mean in (("one", 10), ("two", 20)):
        np.testing.assert_allclose(table[f"{tracker}_tracked_strain_RR_percent"], mean)
        np.testing.assert_allclose(table[f"{tracker}_segment_07_tracked_strain_TT_percent"], mean + 1)
        np.testing.assert_allclose(table[f"{tracker}_true_strain_TT_percent"], 30)
        np.testing.assert_allclose(table[f"{tracker}_segment_07_true_strain_RR_percent"], 31)


def test_only_chosen_trackers_have_columns(known, tmp_path):
    work = Export(source(known.folder, Selection(views=["mid"], trackers=["two"])), "csv", output=tmp_path)
    (file,) = work.write(work.clips()[0])
    with file.open(newline="") as lines:
        header = next(csv.reader(lines))
    assert any(name.startswith("two_") for name in header) and not any(name.startswith("one_") for name in header)

"""MAT-files, read by SciPy as MATLAB shows them: rows are axial, columns lateral."""

import numpy as np
import pytest
from known_repository import FRAMES, SHIFT, SIZES
from scipy.io import loadmat

from echotruth.sharing.export import ExportError, matlab


@pytest.fixture(scope="module")
def clip(exported_once):
    return loadmat(exported_once("matlab"), simplify_cells=True)["clip"]


def test_images_are_rows_by_columns_by_frame(clip, known):
    assert clip["image"].dtype == np.uint8
    np.testing.assert_array_equal(np.moveaxis(clip["image"], -1, 0), known.images(SIZES[0]))
    bright = clip["image"][..., 0] == 220
    assert clip["axial_m"][bright.any(axis=1)].mean() == pytest.approx(24 / SIZES[0] * 12e-3)
    assert clip["lateral_m"][bright.any(axis=0)].mean() == pytest.approx((104 - 64) / SIZES[0] * 12e-3)
    np.testing.assert_allclose(clip["time_s"], 0.12 / FRAMES * np.arange(FRAMES))
    assert clip["spacing_m"] == pytest.approx(12e-3 / SIZES[0])


def test_truth_is_the_shift_in_the_wall(clip):
    wall = clip["mask"][..., -1] > 0
    assert wall.any() and clip["vectors"].tolist() == ["lateral", "axial", "elevation"]
    np.testing.assert_allclose(clip["displacement"][..., -1][wall], np.broadcast_to(SHIFT, (wall.sum(), 3)), atol=2e-7)
    assert np.isnan(clip["displacement"][..., -1][~wall]).all()
    np.testing.assert_array_equal(clip["segment"][..., -1] > 0, wall)


def test_trackers_are_told_apart(clip):
    one, two = (clip["tracked"][name]["displacement"] for name in ("one", "two"))
    assert one.shape == (len(clip["tracked"]["axial_m"]), len(clip["tracked"]["lateral_m"]), 2, FRAMES)
    np.testing.assert_allclose(one, 1e-4, atol=2e-7)
    np.testing.assert_allclose(two, 2e-4, atol=2e-7)


def test_bytes_are_the_same_twice(exported):
    first = exported("matlab", size=SIZES[1]).read_bytes()
    assert exported("matlab", size=SIZES[1]).read_bytes() == first
    assert first[:24] == b"MATLAB 5.0 MAT-file, wri" and len(first[:128]) == 128


def test_clip_whose_arrays_together_are_too_large_is_refused(exported, monkeypatch, clip):
    arrays = [array for array in clip.values() if np.ndim(array) > 2]
    monkeypatch.setattr(matlab, "MAX_BYTES", max(array.nbytes for array in arrays))
    with pytest.raises(ExportError, match=r"a MAT-file holds 2\.1: use a smaller --size"):
        exported("matlab")

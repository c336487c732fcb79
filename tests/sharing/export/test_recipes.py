"""The formats for which the page on export has a few lines, read back by others than who writes them."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import echotruth as et

PAGE = Path(__file__).parents[3] / "docs/export.md"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Folder in which the Python of the page ran."""
    folder = tmp_path_factory.mktemp("recipes")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        exec("".join(re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)), {})
    return folder


def test_mat_file_has_the_clip_with_the_frames_last(written):
    found, clip = loadmat(written / "healthy_mid.mat", simplify_cells=True)["clip"], et.sample().clip("healthy", "mid")
    np.testing.assert_array_equal(np.moveaxis(found["image"], -1, 0), clip["image"].values)
    np.testing.assert_array_equal(np.moveaxis(found["displacement"], -1, 0), clip["displacement"].values)
    np.testing.assert_array_equal(found["axial"], clip["axial"].values)
    assert found["tracked"].shape == (85, 85, 2, 10)


def test_flo_file_has_the_flow_in_pixels_and_1e10_elsewhere(written):
    """Bytes of the format: the number 202021.25, width, height, then both components of each pixel, row by row."""
    assert len([*written.glob("forward_*.flo")]) == 9
    content, clip = (written / "forward_003.flo").read_bytes(), et.sample().clip("healthy", "mid")
    assert np.frombuffer(content[:4], "<f4") == 202021.25 and [*np.frombuffer(content[4:12], "<i4")] == [256, 256]
    flow, wall = np.frombuffer(content[12:], "<f4").reshape(256, 256, 2), clip["mask"][3].values.astype(bool)
    spacing = float(clip["axial"][-1] - clip["axial"][0]) / 255
    for number, name in enumerate(("lateral", "axial")):
        true = clip["flow"].sel(to="next", vector=name)[3].values / spacing
        np.testing.assert_allclose(flow[wall, number], true[wall], rtol=1e-5, atol=1e-6)
    assert (flow[~wall] > 1e9).all() and wall.any()

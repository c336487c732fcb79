"""What a notebook calls does in memory what the workflow does in a repository."""

import subprocess
import sys

import numpy as np
import pytest

import echotruth as et
from echotruth.config import View
from echotruth.config.loading import ConfigError
from echotruth.tracking import TrackerFailed

TUBE = {
    "geometry": {
        "shape": "tube",
        "endo_length_mm": 3,
        "base_mm": 1,
        "circumferential_elements": 12,
        "longitudinal_elements": 4,
        "transmural_elements": 2,
    },
    "motion": {"kind": "rigid", "rigid": {"lateral_um": 60.0, "axial_um": 40.0}},
    "loop": {"frames": 3},
    "views": {"mid": {"position": 0.5}},
    "phantom": {"density_per_mm3": 300.0},
    "rf": {"lines": 48},
    "bmode": {"size_px": 128, "downsampling": (1, 2)},
}


@pytest.fixture(scope="module")
def heart():
    return et.beat(TUBE)


@pytest.fixture(scope="module")
def clip(heart):
    return et.image(heart)


def test_import_takes_less_than_three_tenths_of_a_second_and_loads_no_numba():
    code = (
        "import sys, time; start = time.process_time(); import echotruth; "
        "assert time.process_time() - start < 0.3; assert 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_every_public_name_is_found_and_a_wrong_one_is_refused():
    assert all(getattr(et, name) is not None for name in dir(et))
    with pytest.raises(AttributeError, match="no attribute 'bead'"):
        _ = et.bead


def test_clip_carries_the_exact_shift_and_its_units(clip):
    moved = clip["displacement"].isel(frame=1).where(clip["mask"].isel(frame=1))
    assert float(moved.sel(vector="lateral").mean()) == pytest.approx(60e-6, rel=1e-6)
    assert float(moved.sel(vector="axial").mean()) == pytest.approx(40e-6, rel=1e-6)
    assert clip["displacement"].attrs["units"] == "m"
    assert clip["image"].dtype == np.uint8
    assert clip["image"].values.max() == 255


def test_tracker_that_sees_no_motion_misses_all_of_it(clip, heart):
    def at_rest(frames, points, mask, spacing, frame_time, seed):
        return np.zeros((len(frames), len(points), 2))

    assert et.evaluate(et.track(clip, at_rest), heart)["nrmse_percent"] == pytest.approx(100, rel=1e-6)


def test_true_displacement_in_place_of_a_tracked_one_has_no_error(clip, heart):
    tracked = et.track(clip, "dis")
    truth = np.broadcast_to([60e-6, 40e-6], tracked["displacement"].shape[1:])
    share = np.array([0.0, 1.0, 0.0]) if heart.es == 1 else np.array([0.0, 0.0, 1.0])
    known = tracked["displacement"].notnull()
    exact = tracked.assign(displacement=(tracked["displacement"].dims, share[:, None, None, None] * truth)).where(known)
    assert et.evaluate(exact, heart)["rms_error_um"] < 0.1


def test_other_probe_view_and_size_are_imaged(heart):
    other = et.image(heart, View(plane="long_axis"), probe="mouse_30MHz", size=64)
    assert other["image"].shape == (3, 64, 64)
    assert other.attrs["view"] == "view"


def test_function_that_raises_is_named(clip):
    def broken(*clip):
        raise RuntimeError("no luck")

    with pytest.raises(TrackerFailed, match="broken raised RuntimeError: no luck"):
        et.track(clip, broken)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda heart, clip: et.image(heart, "front"), ValueError, "view = 'front': use one of mid"),
        (lambda heart, clip: et.image(heart, size=100), ValueError, "size = 100: use one of 128, 64"),
        (lambda heart, clip: et.track(clip, "dic"), ConfigError, "method = 'dic': should be"),
        (lambda heart, clip: et.track(clip, "dis", window=3), ConfigError, "window is not a key"),
        (lambda heart, clip: et.configure(geometry={"preset": "cat"}), ConfigError, "geometry.preset = 'cat'"),
        (lambda heart, clip: et.open("out/nowhere"), FileNotFoundError, "out/nowhere.*is not a repository"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_sentence(heart, clip, call, error, words):
    with pytest.raises(error, match=words) as caught:
        call(heart, clip)
    assert "\n" not in str(caught.value)


def test_given_keys_are_merged_into_a_file(tmp_path):
    (tmp_path / "mine.yaml").write_text("geometry: {preset: rat, wall_mm: 2.2}\n")
    config = et.configure(tmp_path / "mine.yaml", geometry={"hypertrophy": 1.1})
    assert (config.geometry.preset, config.geometry.wall_mm, config.geometry.hypertrophy) == ("rat", 2.2, 1.1)
    assert config.probe.preset == "rat_15MHz"

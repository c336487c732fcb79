"""What a notebook calls: configurations, hearts, clips, tracked motion and scores, without a repository."""

import subprocess
import sys
from dataclasses import replace

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
    "tracking": {"grid_px": 2},
}


@pytest.fixture(scope="module")
def heart():
    return et.beat(TUBE)


@pytest.fixture(scope="module")
def clip(heart):
    return et.image(heart)


def test_import_takes_less_than_three_tenths_of_a_second():
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
        (lambda heart, clip: et.track(clip.isel(frame=slice(1, None)), "dis"), ValueError, "has 2 of 3 frames"),
        (lambda heart, clip: et.track(clip.drop_attrs(), "dis"), ValueError, "lost its attribute case"),
        (lambda heart, clip: et.beat({"cases": {"seed": [1, 2]}}), ValueError, "cases sweeps seed"),
        (lambda heart, clip: et.heart_dataset(heart, "rf"), ValueError, "group = 'rf': the heart has geometry"),
        (lambda heart, clip: et.open("out/nowhere"), FileNotFoundError, "out/nowhere.*is not a repository"),
        (lambda heart, clip: et.load_heart("out/nowhere"), FileNotFoundError, "out/nowhere.*is not a repository"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_sentence(heart, clip, call, error, words):
    with pytest.raises(error, match=words) as caught:
        call(heart, clip)
    assert "\n" not in str(caught.value)


def test_another_heart_than_the_one_imaged_is_refused(clip):
    other = et.beat(TUBE | {"motion": {"kind": "rigid", "rigid": {"lateral_um": 30.0}}})
    with pytest.raises(ValueError, match="made of another heart"):
        et.evaluate(et.track(clip, "dis"), other)


def test_scores_of_smaller_images_are_at_the_same_points_of_the_tissue(clip, heart):
    small = et.image(heart, size=64)
    at_all, at_half = (et.evaluate(et.track(each, "dis"), heart) for each in (clip, small))
    np.testing.assert_array_equal(clip["grid_mask"], small["grid_mask"])
    assert np.isfinite(at_all["e_rr_rms_pp"]) and np.isfinite(at_half["e_rr_rms_pp"])


def test_lines_are_kept_where_asked(heart, clip):
    lines = et.image(heart, size=64, keep_lines=True)["lines"]
    assert lines.dims == ("frame", "line", "range") and lines.shape[:2] == (3, 48) and lines.dtype == np.complex64


def test_tracker_of_the_configuration_goes_by_its_name(clip):
    named, method = et.track(clip, "as_published", window_px=16), et.track(clip, "phase_correlation", window_px=16)
    np.testing.assert_array_equal(named["displacement"], method["displacement"])


def test_groups_of_a_heart_have_dimensions_and_units(heart):
    data = et.heart_dataset(heart, "kinematics")
    assert data["strain_mean"].dims == ("frame", "strain_component")
    assert list(data["strain_component"].values[:3]) == ["RR", "CC", "LL"]
    assert et.heart_dataset(heart, "mechanics")["displacement"].attrs["units"] == "m"


def test_strains_and_angles_of_a_heart_follow_from_its_motion():
    stretch = {"gradient": [[1.1, 0, 0], [0, 1.1, 0], [0, 0, 1.1]]}
    found = et.kinematics(et.beat(TUBE | {"motion": {"kind": "affine", "affine": stretch}}))
    assert found.fibre_strain.dims == ("frame", "cell", "fibre_component")
    largest = found.isel(frame=int(found.deformation_gradient.max(("cell", "row", "column")).argmax("frame")))
    expected = (1.1**2 - 1) / 2
    for name, component in (("fibre_strain", "fibre_component"), ("strain", "strain_component")):
        normal, shear = (largest[name].isel({component: part}) for part in (slice(3), slice(3, None)))
        np.testing.assert_allclose(normal, expected, atol=1e-9)
        np.testing.assert_allclose(shear, 0, atol=1e-9)
    assert {found[name].attrs["units"] for name in ("helix_angle", "transverse_angle", "sheet_angle")} == {"rad"}
    with pytest.raises(ValueError, match=r"^The heart has no fibres: make it by"):
        et.kinematics(replace(et.beat(TUBE), arrays={}))


def test_given_keys_are_merged_into_a_file(tmp_path):
    (tmp_path / "mine.yaml").write_text("geometry: {preset: rat, wall_mm: 2.2}\n")
    config = et.configure(tmp_path / "mine.yaml", geometry={"hypertrophy": 1.1})
    assert (config.geometry.preset, config.geometry.wall_mm, config.geometry.hypertrophy) == ("rat", 2.2, 1.1)
    assert config.probe.preset == "rat_15MHz"


def test_given_keys_are_merged_however_deep():
    config = et.configure({"mechanics": {"active": {"stress": "second_piola_kirchhoff"}}}, **{"loop.frames": 20})
    config = et.configure(config, mechanics={"active": {"length_dependence": 0.5}})
    assert (config.mechanics.active.stress, config.mechanics.active.length_dependence) == (
        "second_piola_kirchhoff",
        0.5,
    )
    assert config.loop.frames == 20


def test_what_follows_a_preset_follows_a_new_one_and_what_was_given_stays():
    mouse = et.configure(**{"rf.lines": 100, "bmode.dynamic_range_dB": 60.0})
    human = et.configure(mouse, geometry={"preset": "human"})
    assert (
        human.model_dump()
        == et.configure(**{"geometry.preset": "human", "rf.lines": 100, "bmode.dynamic_range_dB": 60.0}).model_dump()
    )
    other = et.configure(mouse, probe={"preset": "mouse_40MHz"})
    assert other.phantom.density_per_mm3 == et.configure(probe={"preset": "mouse_40MHz"}).phantom.density_per_mm3


@pytest.mark.parametrize("name", ["demo", "paper", "human", "realistic", "phantoms"])
def test_a_configuration_that_nothing_is_changed_in_stays_as_it_is(name):
    config = et.configure(f"config/{name}.yaml")
    assert et.configure(config).model_dump() == config.model_dump()

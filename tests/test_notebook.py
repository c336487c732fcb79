"""What a notebook calls: configurations, hearts, clips, tracked motion and scores, without a repository."""

import subprocess
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import echotruth as et
from echotruth.config import View
from echotruth.config.imaging import Excursion, Offset, ViewMotion
from echotruth.config.loading import ConfigError
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.tracks import visible
from echotruth.repository.derived import derived
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
    "tracking": {"grid": 0.016},
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
    with pytest.raises(AttributeError, match="bead"):
        _ = et.bead


@pytest.mark.slow
def test_clip_carries_the_exact_shift_and_its_units(clip):
    moved = clip["displacement"].isel(frame=1).where(clip["mask"].isel(frame=1))
    quantum = clip["displacement"].attrs["quantum"]
    assert quantum <= 12e-3 / 128 / 256
    assert np.abs(moved.sel(vector="lateral") - 60e-6).max() <= quantum / 2
    assert np.abs(moved.sel(vector="axial") - 40e-6).max() <= quantum / 2
    assert clip["displacement"].attrs["units"] == "m"
    assert clip["image"].dtype == np.uint8
    assert clip["image"].values.max() == 255


def test_flow_of_a_clip_is_the_change_of_its_displacement_where_all_tissue_moves_alike(clip):
    moved = clip["displacement"].where(clip["mask"]).mean(["axial", "lateral"])
    flow, quantum = clip["flow"], clip["flow"].attrs["quantum"]
    assert flow.dims == ("frame", "to", "axial", "lateral", "vector") and flow.attrs["units"] == "m"
    for frame in range(2):
        step = moved.isel(frame=frame + 1) - moved.isel(frame=frame)
        forth = flow.isel(frame=frame).sel(to="next")
        back = flow.isel(frame=frame + 1).sel(to="previous")
        assert np.abs(forth - step).max() <= 2 * quantum and np.abs(back + step).max() <= 2 * quantum
        assert (forth.isel(vector=0).notnull() == clip["mask"].isel(frame=frame)).all()


@pytest.fixture(scope="module")
def repository(textured):
    """Hearts whose wall is lifted out of the short-axis plane on one side and lowered on the other."""
    return textured


@pytest.fixture(scope="module")
def lifted(repository):
    return et.Repository(repository).clip("heart")


def test_clip_of_a_repository_has_the_labels_by_name(repository, lifted):
    stored = et.Repository(repository).tree["clips/heart/mid/truth/64"]["labels"]
    for name in ("layer", "segment", "region"):
        np.testing.assert_array_equal(lifted[name], stored.sel(label=name))
    np.testing.assert_array_equal(lifted["mask"], lifted["displacement"].notnull().all("vector"))
    assert set(np.unique(lifted["region"])) == {0} and "label" not in lifted.dims


def test_tissue_leaves_and_enters_where_it_moves_farther_than_half_the_slice(lifted):
    for mask, to in (("leaves", "next"), ("enters", "previous")):
        elevation = lifted["flow"].sel(to=to, vector="elevation")
        np.testing.assert_array_equal(lifted[mask], np.abs(elevation) > lifted["thickness"] / 2)
        assert lifted[mask].any() and (lifted["mask"] & ~lifted[mask] & elevation.notnull()).any()
    assert not lifted["enters"].isel(frame=0).any() and not lifted["leaves"].isel(frame=-1).any()
    assert lifted["thickness"].attrs["units"] == "m"


@pytest.mark.parametrize("scan", ["sector", "linear"])
def test_slice_is_as_thick_as_it_is_for_points_at_the_same_place(scan):
    """A point within half the thickness of its pixel is visible, and one just beyond it is not."""
    config = et.configure(rf={"scan": scan})
    axial, lateral = pixel_centres(config.bmode, 64)
    flow = np.zeros((1, 2, 64, 64, 3))
    dims = ("frame", "to", "axial", "lateral", "vector")
    coordinates = {"axial": axial, "lateral": lateral, "to": ["previous", "next"]}
    clip = xr.Dataset({"flow": (dims, flow)}, coordinates | {"vector": ["lateral", "axial", "elevation"]})
    half = derived(clip, config)["thickness"].values / 2
    points = np.stack([*np.meshgrid(lateral, axial), 0 * half], axis=-1)
    shown = visible(config, points)
    assert shown.mean() > 0.2
    np.testing.assert_array_equal(visible(config, points + 0.999 * half[..., None] * [0, 0, 1]), shown)
    assert not visible(config, points + 1.001 * half[..., None] * [0, 0, 1]).any()


def test_only_the_variables_asked_for_are_read(repository, lifted):
    pair = et.Repository(repository).clip("heart", variables=("image", "flow"))
    assert set(pair.data_vars) == {"image", "flow", "leaves", "enters", "thickness", "grid_mask"}
    mask = et.Repository(repository).clip("heart", variables="mask")
    assert set(mask.data_vars) == {"mask", "layer", "segment", "region", "grid_mask"}
    for name, values in {**pair.data_vars, **mask.data_vars}.items():
        np.testing.assert_array_equal(values, lifted[name])


@pytest.mark.parametrize("variables, words", [(("image", "speed"), "'speed': use any of"), ((), "none: use any of")])
def test_variables_that_a_clip_does_not_have_are_refused(repository, variables, words):
    with pytest.raises(ValueError, match=words):
        et.Repository(repository).clip("heart", variables=variables)


def test_tracks_of_points_are_the_affine_motion_in_all_frames(repository, lifted):
    heart, start = et.Repository(repository).heart("heart"), 1
    rows, columns = np.nonzero(lifted["mask"].values[start])
    tracks = et.point_tracks(heart, lifted, np.column_stack([columns, rows]), frame=start)
    np.testing.assert_allclose(tracks["pixel"].isel(frame=start), np.column_stack([columns, rows]), atol=1e-9)
    for frame, to in ((0, "previous"), (2, "next")):
        flow = lifted["flow"].sel(to=to).values[start, rows, columns]
        moved = tracks["position"].values[frame] - tracks["position"].values[start]
        np.testing.assert_allclose(moved, flow[:, :2], atol=lifted["flow"].attrs["quantum"])
        np.testing.assert_allclose(tracks["elevation"].values[frame], flow[:, 2], atol=lifted["flow"].attrs["quantum"])
    assert tracks["visible"].isel(frame=start).all()
    assert tracks["visible"].any("point").all() and not tracks["visible"].all()
    assert tracks["pixel"].attrs["units"] == "px" and tracks["time"].dims == ("frame",)


def test_each_point_may_have_its_own_frame_and_one_beside_the_wall_has_no_track(repository, lifted):
    heart = et.Repository(repository).heart("heart")
    rows, columns = np.nonzero(lifted["mask"].values.all(0))
    given = np.array([[columns[0], rows[0]], [columns[-1], rows[-1]], [0, 0]])
    tracks = et.point_tracks(heart, lifted, given, frame=[0, 2, 1])
    np.testing.assert_allclose(tracks["pixel"].values[[0, 2], [0, 1]], given[:2], atol=1e-9)
    assert tracks["position"].isel(point=2).isnull().all() and not tracks["visible"].isel(point=2).any()
    assert et.point_tracks(heart, lifted, np.zeros((0, 2)))["visible"].shape == (3, 0)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"points": [[1.0, 2.0, 3.0]]}, "shape .n, 2."),
        ({"points": [[1.0, np.nan]]}, "finite"),
        ({"points": [[1.0, 2.0]], "frame": 3}, "from 0 to 2, not 3"),
        ({"points": [[1.0, 2.0]], "frame": -1}, "from 0 to 2, not -1"),
        ({"points": [[1.0, 2.0]], "frame": [0, 1]}, "one for each of the 1 points"),
        ({"points": [[1.0, 2.0]], "frame": 0.5}, "one whole number"),
        ({"points": [[1.0, 2.0]], "thickness": 0.0}, "thickness = 0.0: give a positive length"),
    ],
)
def test_points_that_cannot_be_followed_are_refused(heart, clip, arguments, words):
    with pytest.raises(ValueError, match=words):
        et.point_tracks(heart, clip, **arguments)


def test_tracker_that_sees_no_motion_misses_all_of_it(clip, heart):
    def at_rest(frames, points, mask, spacing, frame_time, seed):
        return np.zeros((len(frames), len(points), 2))

    assert et.evaluate(et.track(clip, at_rest), heart)["nrmse_percent"] == pytest.approx(100, rel=1e-6)


def test_tracker_of_a_low_frame_rate_is_given_every_second_frame_and_found_to_move_evenly_in_between(clip):
    given = []

    def drifting(frames, points, mask, spacing, frame_time, seed):
        given.append((len(frames), frame_time[1]))
        return np.arange(len(frames))[:, None, None] * np.ones((len(points), 2))

    slow = clip.assign_attrs(config=et.configure(TUBE, **{"tracking.frame_step": 2}).model_dump_json())
    moved = et.track(slow, drifting)["displacement"].mean(["axial", "lateral", "plane"]).values
    assert given == [(2, float(clip["time"][2]))]
    assert moved / moved[2] == pytest.approx([0, 0.5, 1], abs=1 / 256)  # px, to which it is stored


def test_true_displacement_in_place_of_a_tracked_one_has_no_error(clip, heart):
    tracked = et.track(clip, "dis")
    truth = np.broadcast_to([60e-6, 40e-6], tracked["displacement"].shape[1:])
    share = np.array([0.0, 1.0, 0.0]) if heart.es == 1 else np.array([0.0, 0.0, 1.0])
    known = tracked["displacement"].notnull()
    exact = tracked.assign(displacement=(tracked["displacement"].dims, share[:, None, None, None] * truth)).where(known)
    assert et.evaluate(exact, heart)["rms_error_um"] < 0.1


MOVING = View(
    position=0.5,
    angle_deg=20.0,
    offset=Offset(lateral_mm=0.4),
    motion=ViewMotion(drift=Excursion(lateral_mm=0.6, axial_mm=-0.3)),
)


def test_motion_of_the_probe_is_in_image_truth_tracks_and_scores():
    """A tube at rest drifts by a third of the way in each of three frames, in the images too."""
    heart = et.beat(TUBE | {"motion": {"kind": "rigid", "rigid": {"lateral_um": 0.0, "axial_um": 0.0}}})
    clip = et.image(heart, MOVING)
    drift = np.array([0.6e-3, -0.3e-3, 0]) * np.arange(3)[:, None] / 3
    wall = clip["mask"].values
    for frame in range(3):
        np.testing.assert_allclose(clip["displacement"].values[frame][wall[frame]] - drift[frame], 0, atol=2e-7)
    tracked = et.track(clip, "dis")
    found = tracked["displacement"].values[:, clip["grid_mask"].values]
    np.testing.assert_allclose(np.median(found, axis=1), drift[:, :2], atol=20e-6)  # a fifth of a pixel
    true = tracked.copy(deep=True)
    true["displacement"][:] = drift[:, None, None, :2]
    assert et.evaluate(true, heart)["nrmse_percent"] < 0.1 < et.evaluate(tracked, heart)["nrmse_percent"]
    point = np.argwhere(wall[0])[:1, ::-1]
    path = et.point_tracks(heart, clip, point)["position"].values[:, 0]
    np.testing.assert_allclose(path - path[0], drift[:, :2], atol=1e-12)


def test_function_that_raises_is_named(clip):
    def broken(*clip):
        raise RuntimeError("no luck")

    with pytest.raises(TrackerFailed, match="broken raised RuntimeError: no luck"):
        et.track(clip, broken)


CROPPED, INFINITE = "clip's axial is not that of its image", "Frame 1 has pixels that are infinite: give numbers"


def with_pixel(clip, value):
    """The clip with one other pixel in frame 1."""
    image = clip["image"].astype(float)
    image[1, 5, 7] = value
    return clip.assign(image=image)


def test_clip_whose_dimensions_are_in_another_order_is_tracked_as_before(clip):
    expected = et.track(clip, "dis")
    found = et.track(clip.transpose("lateral", "frame", "axial", ...), "dis")
    assert np.isfinite(expected["displacement"]).any()
    np.testing.assert_array_equal(found["displacement"], expected["displacement"])


def test_pixels_that_are_not_known_are_told(clip):
    with pytest.warns(UserWarning, match="1 of 3 frames have pixels that are NaN: no displacement is estimated from"):
        et.track(with_pixel(clip, np.nan), "dis")


@pytest.mark.slow
def test_repeated_frame_and_lengths_for_another_heart_are_told(clip):
    image = clip["image"].copy()
    image[1] = image[0]
    with pytest.warns(UserWarning, match="1 of 3 frames show the same image as the one before"):
        et.track(clip.assign(image=image), "dis")
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # it is told before what takes long
        with pytest.raises(UserWarning, match=r"knots_mm = 0\.04 suits a wall 0\.085 mm thick, and this one has"):
            et.track(clip, "bspline_dic", knots_mm=0.04)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda heart, clip: et.image(heart, "front"), ValueError, "view = 'front': use one of mid"),
        (lambda heart, clip: et.track(clip, "dic"), ConfigError, "dic: is not a tracker: did you mean dis"),
        (lambda heart, clip: et.track(clip, "dis", window=3), ConfigError, "window is not a key"),
        (lambda heart, clip: et.configure(geometry={"preset": "cat"}), ConfigError, "geometry.preset = 'cat'"),
        (
            lambda heart, clip: et.track(clip.isel(frame=slice(1, None)), "dis"),
            ValueError,
            "is not that of its image: give all",
        ),
        (lambda heart, clip: et.track(clip.isel(frame=[0, 2, 1]), "dis"), ValueError, "clip's time is not that of its"),
        (
            lambda heart, clip: et.track(clip.isel({"axial": slice(64), "lateral": slice(64)}), "dis"),
            ValueError,
            CROPPED,
        ),
        (lambda heart, clip: et.track(with_pixel(clip, np.inf), "dis"), ValueError, INFINITE),
        (lambda heart, clip: et.track(clip.drop_attrs(), "dis"), ValueError, "lost its attribute case"),
        (lambda heart, clip: et.beat({"cases": {"seed": [1, 2]}}), ValueError, "cases sweeps seed"),
        (lambda heart, clip: et.heart_dataset(heart, "rf"), ValueError, "group = 'rf': the heart has geometry"),
        (lambda heart, clip: et.evaluate(clip, heart), ValueError, "tracked: has no displacement .*et.track returns"),
        (lambda heart, clip: et.Repository("out/nowhere"), FileNotFoundError, "out/nowhere.*is not a repository"),
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
    with pytest.raises(ValueError, match="made of another heart"):
        et.point_tracks(other, clip, [[1.0, 2.0]])


@pytest.mark.slow
def test_scores_of_smaller_images_are_at_the_same_points_of_the_tissue_and_lines_are_kept_where_asked(clip, heart):
    small = et.image(heart, size=64, keep_lines=True)
    assert small["lines"].dims == ("frame", "line", "range") and small["lines"].dtype == np.complex64
    at_all, at_half = (et.evaluate(et.track(each, "dis"), heart) for each in (clip, small))
    np.testing.assert_array_equal(clip["grid_mask"], small["grid_mask"])
    assert np.isfinite(at_all["e_rr_rms_pp"]) and np.isfinite(at_half["e_rr_rms_pp"])


def test_tracker_of_the_configuration_goes_by_its_name(clip):
    settings = et.Config().tracking.trackers["corrected"].model_dump(exclude={"method"}) | {"window_mm": 2.0}
    named, method = et.track(clip, "corrected", window_mm=2.0), et.track(clip, "phase_correlation", **settings)
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

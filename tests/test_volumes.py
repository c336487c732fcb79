"""Volumes from a heart to its scores, and what is refused of them."""

import numpy as np
import pytest
import xarray as xr

import echotruth as et
from echotruth.config.loading import ConfigError
from echotruth.imaging.truth import pixel_truth
from echotruth.repository.datasets import imaged_heart

SHIFT = np.array([6.3e-3 / 32, -2 * 6.3e-3 / 48, 6.6e-3 / 33])
"""Lateral, axial and elevation shift of the heart in the last frame, m: one voxel, two up, and one."""
SETTINGS = {
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
    "loop": {"frames": 3},
    "motion": {
        "kind": "rigid",
        "time_course": "ramp",
        "rigid": dict(zip(("lateral_um", "axial_um", "elevation_um"), 1e6 * SHIFT, strict=True))
        | {"rotation_deg": 0.0},
    },
    "views": {"whole": {"plane": "volume"}},
    "probe": {"preset": "mouse_row_column_15MHz", "elements": 36, "pitch_um": 190.0},
    "phantom": {"density_per_mm3": 200.0},
    "volume": {"size": [48, 33, 32], "field_mm": [6.3, 6.6, 6.3]},
}


@pytest.fixture(scope="module")
def heart():
    return et.beat(et.configure(**SETTINGS))


@pytest.fixture(scope="module")
def clip(heart):
    return et.image(heart, "whole")


def test_speckle_moves_with_the_heart(clip):
    image, mask = clip["image"].values.astype(float), clip["mask"].values
    assert clip["image"].dims == ("frame", "axial", "elevation", "lateral") and clip["image"].dtype == np.uint8
    assert image[0][mask].mean() > 1.5 * image[0][~mask].mean() > 0
    follows = np.roll(image[2], (2, -1, -1), axis=(0, 1, 2))
    assert np.corrcoef(image[0][mask], follows[mask])[0, 1] > 0.6
    assert np.corrcoef(image[0][mask], image[2][mask])[0, 1] < 0.2


def test_same_seed_gives_the_same_bytes(heart, clip):
    assert et.image(heart, "whole")["image"].equals(clip["image"])


def test_truth_at_voxels_is_that_at_pixels_of_the_slice_through_them(heart, clip):
    truth, (moving, plane) = et.voxel_truth(clip, heart, 2), imaged_heart(clip, heart)
    middle = int(np.flatnonzero(np.abs(clip["elevation"].values) < 1e-9)[0])
    pixels = pixel_truth(moving, plane, clip["axial"].values, clip["lateral"].values)
    of_slice = truth.isel(elevation=middle)
    for name in ("displacement", "strain", "wall_depth"):
        np.testing.assert_allclose(of_slice[name], pixels[name][2], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(of_slice["segment"], pixels["labels"][2, 1])
    assert (truth["layer"] > 0).sum() > 3000
    in_wall = truth["displacement"].values[truth["layer"].values > 0]
    np.testing.assert_allclose(in_wall, np.broadcast_to(SHIFT, in_wall.shape), atol=1e-9)


def test_realistic_volume_has_blood_and_surroundings_and_noise(heart):
    realism = {"preset": "mouse", "ring_down": {"level_dB": None}}
    config = et.configure(heart.config, realism=realism, bmode={"dropout": {"loss_dB": 0.0, "edge_loss_dB": 0.0}})
    realistic = et.image(type(heart).of(heart.arrays, config), "whole")
    image, mask = realistic["image"].values[0], realistic["mask"].values
    assert (image[~mask] > 0).mean() > 0.9 and image[mask].mean() > image[~mask].mean()


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"volume.field_mm": [6.3, 9.0, 6.3]}, "volume.field_mm"),
        ({"volume.field_mm": [14.0, 6.6, 6.3]}, "before the array"),
        ({"volume.size": [1000, 1000, 1000]}, "GB of memory"),
        ({"probe.elements": 16}, "mouse_row_column_15MHz"),
        ({"rf.harmonic": True}, "rf.harmonic"),
        ({"realism.ring_down.level_dB": 3.0}, "realism.ring_down.level_dB"),
    ],
)
def test_what_no_volume_can_have_is_refused(keys, said):
    with pytest.raises(ConfigError, match=said):
        et.configure(et.configure(**SETTINGS), **keys)


def test_volume_is_refused_by_what_takes_slices(heart, clip):
    with pytest.raises(ValueError, match="is of volumes"):
        et.point_tracks(heart, clip, np.zeros((1, 2)))
    with pytest.raises(ValueError, match="frame = 3: use a whole number from 0 to 2"):
        et.voxel_truth(clip, heart, 3)
    with pytest.raises(ValueError, match="is no volume"):
        et.voxel_truth(clip.isel(elevation=0, drop=True), heart, 0)


def test_tracker_that_knows_the_motion_has_no_error_and_one_that_sees_none_all_of_it(heart, clip):
    def knowing(frames, points, mask, spacing, frame_time, seed):
        lateral, axial, elevation = SHIFT
        return np.multiply.outer([0, 0.5, 1], np.ones_like(points) * [lateral, elevation, axial] / spacing)

    def still(frames, points, mask, spacing, frame_time, seed):
        return np.zeros((len(frames), *points.shape))

    with pytest.warns(UserWarning, match="reaches a face of the volume"):
        tracked = et.track(clip, knowing)
    scores = et.evaluate(tracked, heart)
    assert scores["nrmse_cycle_percent"] < 0.2 and abs(scores["segment_e_rr_bias_pp"]) < 1e-9
    assert scores["coverage_percent"] == 100 and scores["drift_um"] < 0.5 and abs(scores["twist_bias_deg"]) < 1e-6
    swapped = tracked.isel(vector=[2, 0, 1])
    assert et.evaluate(swapped.transpose(), heart)["nrmse_percent"] == scores["nrmse_percent"]
    with pytest.warns(UserWarning, match="reaches a face of the volume"):
        assert et.evaluate(et.track(clip, still), heart)["nrmse_percent"] == pytest.approx(100)


def test_what_is_no_track_of_the_wall_is_refused(heart, clip):
    still = xr.Dataset(
        {"displacement": (("frame", "point", "vector"), np.zeros((3, 1, 3)))},
        {name: ("point", [0.0]) for name in ("lateral", "axial", "elevation")}
        | {"frame": [0, 1, 2], "vector": ["lateral", "axial", "elevation"]},
        clip.attrs,
    )
    with pytest.raises(ValueError, match="1 of its points are not in the wall"):
        et.evaluate(still, heart)
    with pytest.raises(ValueError, match="frames 0 to 2 of the heart, in their order"):
        et.evaluate(still.isel(frame=[2, 1, 0]), heart)
    with pytest.raises(ValueError, match="has no displacement"):
        et.evaluate(still.isel(vector=0, drop=True), heart)


def test_view_without_the_heart_is_refused_before_it_is_imaged(heart):
    with pytest.raises(ValueError, match="There is no wall in the volume"):
        et.image(heart, et.View(plane="volume", offset={"lateral_mm": 6.0}))
    with pytest.raises(ValueError, match="are of slices"):
        et.image(heart, "whole", size=128)


def test_truth_of_a_part_is_part_of_the_truth(heart, clip):
    part = {"lateral": slice(9, 3, -1), "axial": slice(2, 20)}
    whole = et.voxel_truth(clip, heart, 1)
    xr.testing.assert_equal(et.voxel_truth(clip.isel(part), heart, 1), whole.isel(part))

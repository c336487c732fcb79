"""Recordings of EchoXFlow: the store is written here by hand, as their loader wants it, and every place is known."""

import shutil
import sys

import numpy as np
import pytest
import zarr

import echotruth as et
from echotruth import cli
from echotruth.echo import echoxflow
from echotruth.echo.failure import EchoError

DEPTH, ANGLE = (0.01, 0.09), (-0.3, 0.5)
"""Of the first and last sample, m, and of the first and last line, rad."""
RANGE, THETA = np.linspace(*DEPTH, 81), np.linspace(*ANGLE, 33)
TIME = np.array([2.0, 2.02, 2.05, 2.07], np.float32)
ENDS = {"depth_start_m": DEPTH[0], "depth_end_m": DEPTH[1], "angle_start_rad": ANGLE[0], "angle_end_rad": ANGLE[1]}
MIDDLE = {"depth_start_m": DEPTH[0], "depth_end_m": DEPTH[1], "tilt_rad": 0.1, "width_rad": 0.8}
CAPITALS = {"DepthStart": DEPTH[0], "DepthEnd": DEPTH[1], "Tilt": 0.1, "Width": 0.8}
NAMED = {"array_path": "data/2d_brightness_mode", "format": "zarr_array"}
TIMED = {"array_path": "timestamps/2d_brightness_mode", "format": "zarr_array"}


def level(range_, theta, frame):
    """Grey level that is linear in range and angle, so that linear interpolation keeps it."""
    return 20 + 1500 * range_ + 80 * (theta + 0.3) + 5 * frame


LINES = np.rint([level(RANGE[:, None], THETA, frame) for frame in range(len(TIME))]).astype(np.uint8)


def store(folder, geometry=ENDS, lines=LINES, time=TIME, sector=None):
    sector = {"semantic_id": "bmode", "frames": NAMED, "timestamps": TIMED, "geometry": geometry} | (sector or {})
    group = zarr.open_group(folder, mode="w")
    doppler = {"semantic_id": "2d_color_doppler_velocity", "geometry": MIDDLE | {"depth_end_m": 0.05}}
    group.attrs["recording_manifest"] = {"manifest_type": "2d", "sectors": [doppler, sector]}
    if lines is not None:
        group.create_array("data/2d_brightness_mode", data=lines)
    if time is not None:
        group.create_array("timestamps/2d_brightness_mode", data=time)
    return folder


def places(clip):
    """Lateral and axial coordinates of the pixels, m, from the array: the box about the sector begins at its corner."""
    lateral = DEPTH[1] * np.sin(ANGLE[0]) + clip["lateral"].values
    return lateral, DEPTH[0] * np.cos(ANGLE[1]) + clip["axial"].values[:, None]


@pytest.mark.parametrize("geometry", [ENDS, MIDDLE, CAPITALS], ids=["ends", "middle", "capitals"])
def test_levels_lie_at_their_range_and_angle(tmp_path, geometry):
    clip = et.read_clip(store(tmp_path / "a.zarr", geometry))
    lateral, axial = places(clip)
    range_, theta = np.hypot(lateral, axial), np.arctan2(lateral, axial)
    inside = (range_ > DEPTH[0]) & (range_ < DEPTH[1] - 1e-9) & (theta > ANGLE[0] + 1e-9) & (theta < ANGLE[1] - 1e-9)
    for frame, image in enumerate(clip["image"].values):
        assert abs(image - level(range_, theta, frame))[inside].max() < 1.01
        assert not image[~inside].any(where=(range_ > DEPTH[1] + 1e-9)[~inside])
    assert clip.attrs["spacing"] == pytest.approx((DEPTH[1] - DEPTH[0] * np.cos(ANGLE[1])) / 80)
    np.testing.assert_allclose(clip["time"], TIME - 2.0, atol=1e-6)


def test_store_may_be_a_zip_file(tmp_path):
    folder = store(tmp_path / "a.zarr")
    shutil.make_archive(tmp_path / "b", "zip", folder)
    (tmp_path / "b.zip").rename(tmp_path / "b.zarr")
    np.testing.assert_array_equal(et.read_clip(tmp_path / "b.zarr")["image"], et.read_clip(folder)["image"])


def test_manifest_may_name_the_array_alone_and_other_times(tmp_path):
    sector = {"semantic_id": "", "timestamps": {"zarr_path": "timelines/frames", "format": "zarr_array"}}
    path = store(tmp_path / "a.zarr", sector=sector)
    zarr.open_group(path).create_array("timelines/frames", data=2 * TIME)
    np.testing.assert_allclose(et.read_clip(path)["time"], 2 * (TIME - 2.0), atol=1e-6)
    unnamed = et.read_clip(store(tmp_path / "b.zarr", sector={"frames": None, "timestamps": None}))
    np.testing.assert_allclose(unnamed["time"], TIME - 2.0, atol=1e-6)


def test_published_loader_reads_the_same(tmp_path):
    loader = pytest.importorskip("echoxflow", reason="is in no package index")
    from echoxflow.scan import CartesianGrid, sector_to_cartesian

    path = store(tmp_path / "a.zarr")
    stream, clip = loader.open_recording(path).load_stream("2d_brightness_mode"), et.read_clip(path)
    lateral, axial = places(clip)
    shape = clip["image"].shape[1:]
    grid = CartesianGrid(shape, tuple(lateral[[0, -1]]), tuple(axial.ravel()[[0, -1]]))
    for image, lines in zip(clip["image"].values, stream.data, strict=True):
        theirs = sector_to_cartesian(lines, stream.metadata.geometry, grid=grid)
        apart = abs(theirs.data.astype(int) - image)
        assert np.mean(apart > 1) < 1e-3  # pixels on the very edge, which one has within the sector
    np.testing.assert_allclose(stream.timestamps - stream.timestamps[0], clip["time"], atol=1e-6)


def without(name):
    return {key: value for key, value in ENDS.items() if key != name}


REFUSED = {
    "levels": ({"lines": None}, "has no data/2d_brightness_mode: give a recording"),
    "real": ({"lines": LINES.astype(np.float32)}, r"of the shape \(4, 81, 33\) of float32: give uint8"),
    "image": ({"lines": LINES[0]}, r"of the shape \(81, 33\) of uint8: give uint8 \(time, range, angle\)"),
    "times": ({"time": TIME[1:]}, r"has 4 frames, and timestamps/2d_brightness_mode of the shape \(3,\): give one"),
    "time": ({"time": None}, "does not say the time from frame to frame: give frame_time_ms"),
    "sector": ({"geometry": None}, "has depth_start_m = None: give the geometry of the sector"),
    "depth": ({"geometry": without("depth_end_m")}, "has depth_end_m = None"),
    "text": ({"geometry": ENDS | {"angle_end_rad": "wide"}}, "has angle_end_rad = wide"),
    "turned": ({"geometry": ENDS | {"angle_start_rad": 0.6}}, "has a sector of 0.01 to 0.09 m and 0.6 to 0.5 rad"),
    "manifest": ({"sector": {"frames": "data"}}, "is no Zarr store of a recording that can be read"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_wrong_is_said_in_a_sentence(tmp_path, name):
    options, said = REFUSED[name]
    with pytest.raises(EchoError, match=said):
        et.read_clip(store(tmp_path / "a.zarr", **options))


def test_what_is_no_store_is_said(tmp_path):
    (tmp_path / "a.zarr").write_bytes(b"no zip")
    with pytest.raises(EchoError, match="is no Zarr store"):
        et.read_clip(tmp_path / "a.zarr")
    (tmp_path / "empty.zarr").mkdir()
    with pytest.raises(EchoError, match="is no Zarr store"):
        et.read_clip(tmp_path / "empty.zarr")


def test_command_asks_for_the_wall_alone(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["echotruth", "track", str(store(tmp_path / "a.zarr"))])
    with pytest.raises(SystemExit) as done:
        cli.main()
    assert done.value.code == 2
    said = capsys.readouterr().err
    assert "a.wall.csv: is not there: draw the wall" in said and "--spacing-mm" not in said


def test_sector_beside_the_axis_has_its_own_box():
    """Of lines from 0.2 to 0.6 rad, the box begins at the near end of the first line."""
    frames, spacing = echoxflow.scan_convert(np.full((1, 81, 33), 9, np.uint8), DEPTH, (0.2, 0.6))
    assert spacing * 80 == pytest.approx(DEPTH[1] * np.cos(0.2) - DEPTH[0] * np.cos(0.6))
    assert frames.shape[2] * spacing == pytest.approx(DEPTH[1] * np.sin(0.6) - DEPTH[0] * np.sin(0.2), abs=spacing)

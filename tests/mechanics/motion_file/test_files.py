"""Files of a series: their order, and the hash of their content."""

import os

import numpy as np
import pytest
from affine_motion import FRAMES

from echotruth.mechanics.motion_file.files import content_hash, series_files


def test_frames_are_in_the_order_of_their_numbers(tmp_path):
    for number in (10, 9, 1):
        (tmp_path / f"frame_{number}.vtk").touch()
    assert [file.stem for file in series_files(str(tmp_path / "frame_*.vtk"))] == ["frame_1", "frame_9", "frame_10"]


@pytest.mark.parametrize("format_, file", [("vtu", "frame_7.vtu"), ("pvd", "heart_p0_000007.vtu")])
def test_hash_follows_the_content_of_every_file_and_nothing_else(affine_heart, write_series, tmp_path, format_, file):
    positions = affine_heart.positions(1, np.arange(FRAMES) / FRAMES)
    path = write_series(format_, positions, affine_heart.of_order[1][1])["path"]
    before = content_hash(path)
    assert len(before) == 16
    os.utime(path if "*" not in path else tmp_path / file, (0, 0))
    assert content_hash(path) == before
    content = bytearray((tmp_path / file).read_bytes())
    content[-100] ^= 1
    (tmp_path / file).write_bytes(content)
    assert content_hash(path) != before


def test_hash_of_nothing_is_empty():
    assert content_hash("none_*.vtu") == ""

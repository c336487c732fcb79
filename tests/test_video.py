import os

import numpy as np

from echotruth import video


def test_video_has_the_same_bytes_on_one_core(tmp_path):
    frames, cores = np.random.default_rng(0).integers(0, 255, (6, 300, 690, 3), np.uint8), os.sched_getaffinity(0)
    video.write(tmp_path / "many.mp4", frames, 20)
    os.sched_setaffinity(0, {min(cores)})
    try:
        video.write(tmp_path / "one.mp4", frames, 20)
    finally:
        os.sched_setaffinity(0, cores)
    written = (tmp_path / "one.mp4").read_bytes()
    assert written == (tmp_path / "many.mp4").read_bytes() and written[4:8] == b"ftyp"

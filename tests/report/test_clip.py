import numpy as np
import pytest
from PIL import Image

from echotruth.report import clip


@pytest.fixture
def made():
    """Four frames of noise whose points go down and to the right."""
    image = np.random.default_rng(0).integers(0, 120, (4, 96, 96)).astype(np.uint8)
    position = np.stack(np.meshgrid([40.0, 56.0], [40.0, 56.0]), -1).reshape(-1, 2)
    motion = np.arange(4)[:, None, None] * np.array([2.0, 1.0]) * 1e-4
    return clip.ClipWithMotion(image, 1e-4, np.arange(4) * 3e-3, position, np.broadcast_to(motion, (4, 4, 2)).copy())


def test_thin_keeps_its_distance():
    position = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0)), -1).reshape(-1, 2)
    chosen = position[clip.thin(position, 3)]
    apart = np.linalg.norm(chosen[:, None] - chosen, axis=-1) + 99 * np.eye(len(chosen))
    assert apart.min() >= 3 and len(chosen) >= 9


def test_frames_show_the_motion(made):
    frames = clip.render(made, 240)
    assert frames.shape == (4, 240, 240, 3) and frames.dtype == np.uint8
    # The image is grey, so that what has a hue is drawn over it.
    drawn = [(frame[..., 0] - frame[..., 2] > 60).sum() for frame in frames.astype(int)]
    assert 0 < drawn[0] < drawn[1] < drawn[3]


def test_lost_points_do_not_stop_the_clip(made):
    made.displacement[2:, 1] = np.nan
    assert clip.render(made, 120).std() > 5


def test_gif_and_video(made, tmp_path):
    frames = clip.render(made, 120)
    picture = Image.open(clip.gif(tmp_path / "clip.gif", frames))
    assert picture.n_frames == 4 and picture.size == (120, 120) and picture.info["duration"] == 50
    video = clip.mp4(tmp_path / "clip.mp4", frames).read_bytes()
    assert video[4:8] == b"ftyp" and len(video) > 1000


def test_gif_shows_what_its_frames_show(made, tmp_path):
    frames = clip.render(made, 240)
    picture = Image.open(clip.gif(tmp_path / "clip.gif", frames))
    picture.seek(2)
    shown, drawn = np.asarray(picture.convert("RGB")).astype(int), frames[2].astype(int)
    assert np.abs(shown - drawn).mean() < 5
    coloured = drawn[..., 0] - drawn[..., 2] > 60
    assert np.abs(shown - drawn)[coloured].mean() < 12


def test_gif_of_noise_stays_small(tmp_path):
    frames = np.random.default_rng(0).integers(0, 256, (40, 400, 400, 1)).astype(np.uint8).repeat(3, -1)
    assert clip.gif(tmp_path / "clip.gif", frames).stat().st_size < 1.3 * clip.MAX_GIF_BYTES

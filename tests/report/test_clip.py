import numpy as np
import pytest
from PIL import Image

from echotruth.report import clip, style


@pytest.fixture
def made():
    """Four frames of noise whose points go down and to the right."""
    image = np.random.default_rng(0).integers(0, 120, (4, 96, 96)).astype(np.uint8)
    position = np.stack(np.meshgrid([40.0, 56.0], [40.0, 56.0]), -1).reshape(-1, 2)
    motion = np.arange(4)[:, None, None] * np.array([2.0, 1.0]) * 1e-4
    return clip.ClipWithMotion(image, 1e-4, np.arange(4) * 3e-3, position, np.broadcast_to(motion, (4, 4, 2)).copy())


@pytest.fixture
def strain():
    """Shortening of a square of tissue, none outside."""
    found = np.full((4, 96, 96), np.nan)
    found[:, 40:60, 40:60] = -0.2
    return found


def drawn(made, strain, height):
    return clip.render(made, strain, style.QUANTITIES["CC"], height)


def test_frames_show_the_image_and_beside_it_the_motion_and_shortening_in_blue(made, strain):
    frames = drawn(made, strain, 240)
    assert frames.shape == (4, 240, 552, 3) and frames.dtype == np.uint8
    plain, truth = frames[:, :, :240].astype(int), frames[:, :, 242:482].astype(int)
    assert (np.ptp(plain, axis=-1) == 0).all(), "the image is grey"
    amber = [(frame[..., 0] - frame[..., 2] > 60).sum() for frame in truth]
    assert 0 < amber[0] < amber[1] < amber[3]
    assert all((frame[..., 2] - frame[..., 0] > 40).sum() > 1000 for frame in truth)


def test_dark_wall_is_brightened_and_a_bright_one_left_as_it_is():
    dark, bright, wall = np.full((2, 4, 4), 30), np.full((2, 4, 4), 200), np.ones((2, 4, 4), bool)
    assert clip._brightened(dark, wall) == pytest.approx(clip.WALL_GREY)
    assert (clip._brightened(bright, wall) == bright).all()


def test_lost_points_do_not_stop_the_clip(made, strain):
    made.displacement[2:, 1] = np.nan
    assert drawn(made, strain, 120).std() > 5


def test_animation_has_all_frames(made, strain, tmp_path):
    picture = Image.open(clip.webp(tmp_path / "clip.webp", drawn(made, strain, 120)))
    assert picture.n_frames == 4 and picture.size == (276, 120)

import cv2
import numpy as np
import pytest

from echotruth.config.tracking import Dis
from echotruth.tracking import track
from echotruth.tracking.trackers.dis import MIN_IMAGE_SIDE, optical_flow

SHIFT = np.array([3.0, -1.5])


@pytest.fixture
def pair(clip):
    return clip(lambda place, t: place + t * SHIFT, 2)


@pytest.mark.parametrize("preset", ["fast", "medium"])
def test_motion_at_whole_pixels_is_the_library_s_own(pair, preset):
    points = np.array([[40.0, 60.0], [100.0, 31.0]])
    moved, _ = track(pair, points, np.ones((160, 160), bool), 3e-5, np.arange(2.0), 0, Dis(preset=preset))
    library = cv2.DISOpticalFlow_create(getattr(cv2, f"DISOPTICAL_FLOW_PRESET_{preset.upper()}"))
    cv2.setNumThreads(1)
    np.testing.assert_allclose(moved[1], library.calc(*pair, None)[[60, 31], [40, 100]], atol=1e-5)


def test_fine_setting_is_the_library_s_own_at_full_size_and_nearer_to_a_shear(clip):
    """Speckle whose lateral shift changes by 2 px over 20 px along the depth, and back."""

    def wave(place):
        return np.sin(2 * np.pi * place[:, 1] / 40)

    frames = clip(lambda place, t: place + t * np.stack([wave(place), 0 * place[:, 1]], axis=1), 2)
    along = np.arange(40, 121, 4.0)
    points = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    errors = {}
    for preset in ("medium", "fine"):
        settings = Dis(preset=preset, reference="previous")
        moved, _ = track(frames, points, np.ones((160, 160), bool), 3e-5, np.arange(2.0), 0, settings)
        errors[preset] = np.sqrt(np.mean((moved[1, :, 0] - wave(points)) ** 2))
    assert errors["fine"] < 0.8 * errors["medium"]
    library = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    library.setFinestScale(0)
    library.setPatchSize(16)
    library.setPatchStride(6)
    column, row = points.astype(int).T
    np.testing.assert_allclose(moved[1], library.calc(*frames, None)[row, column], atol=1e-5)


def test_bytes_do_not_depend_on_the_threads_of_the_library(pair):
    images = pair / np.float32(255)
    results = []
    for threads in (1, 4):
        cv2.setNumThreads(threads)
        results.append(optical_flow(*images).tobytes())
    assert results[0] == results[1]


@pytest.mark.parametrize("shape", [(MIN_IMAGE_SIDE, MIN_IMAGE_SIDE), (MIN_IMAGE_SIDE, 300)])
def test_smallest_image_is_taken(shape):
    assert (optical_flow(*np.zeros((2, *shape), np.float32)) == 0).all()


def test_smaller_image_is_refused_in_a_sentence():
    with pytest.raises(ValueError, match=r"32 px or more, not \(31, 40\)"):
        optical_flow(*np.zeros((2, 31, 40), np.float32))

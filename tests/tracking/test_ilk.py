import numpy as np
import pytest
from skimage.registration import optical_flow_ilk

from echotruth.config.tracking import Ilk
from echotruth.tracking import track

SHIFT = np.array([3.0, -1.5])


@pytest.fixture
def pair(clip):
    return clip(lambda place, t: place + t * SHIFT, 2, size=96)


@pytest.mark.parametrize("radius", [5, 7])
def test_motion_at_whole_pixels_is_the_library_s_own(pair, radius):
    points = np.array([[40.0, 60.0], [70.0, 31.0]])
    moved, _ = track(pair, points, np.ones((96, 96), bool), 3e-5, np.arange(2.0), 0, Ilk(radius_px=radius))
    axial, lateral = optical_flow_ilk(*pair, radius=radius)
    np.testing.assert_allclose(moved[1], np.stack([lateral, axial], -1)[[60, 31], [40, 70]], atol=1e-4)

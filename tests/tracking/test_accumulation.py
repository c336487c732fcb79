import numpy as np
import pytest

from echotruth.tracking.accumulation import accumulate

FRAMES = np.arange(7.0)[:, None, None] * np.ones((7, 4, 4))
"""Frames that hold nothing but their number."""


class Formula:
    """Pairs whose motion is known: where a frame number has taken a place, from any frame to any other."""

    def __init__(self, place, lost=()):
        self.place, self.lost = place, lost

    def prepare(self, image):
        return image[0, 0]

    def match(self, first, second, points):
        at_rest = self.place(points, -first)
        step = self.place(at_rest, second) - points
        if second in self.lost:
            step[0] = np.nan
        return step, np.full(len(points), 0.5)


def shear(points, t):
    """What lies deeper moves faster, and all sinks: invertible by minus t."""
    sunk = points + [0, 2.0 * t]
    return sunk + np.stack([0.1 * t * (points[:, 1] + t), 0 * points[:, 1]], -1)


@pytest.fixture
def points():
    return np.array([[10.0, 20.0], [30.0, 5.0]])


def test_formula_undoes_itself(points):
    np.testing.assert_allclose(shear(shear(points, 3.0), -3.0), points, atol=1e-12)


@pytest.mark.parametrize("reference", ["ED", "previous", "cycle"])
def test_steps_are_read_where_the_tissue_then_is(points, reference):
    """The motion is that of the tissue that was at a point at first, whichever frames are compared."""
    moved, quality = accumulate(Formula(shear), FRAMES, points, reference)
    truth = np.stack([shear(points, t) - points for t in range(7)])
    np.testing.assert_allclose(moved, truth, atol=1e-12)
    assert (quality[0] == 1).all() and (quality[1:] == 0.5).all()


def test_frame_to_frame_a_lost_point_stays_lost_and_the_others_do_not(points):
    moved, quality = accumulate(Formula(shear, lost=(3.0,)), FRAMES, points, "previous")
    lost = np.isnan(moved).any(-1)
    np.testing.assert_array_equal(lost[:, 0], np.arange(7) >= 3)
    assert not lost[:, 1].any() and (np.isnan(quality) == lost).all()


@pytest.mark.parametrize("reference", ["ED", "cycle"])
def test_against_end_diastole_and_by_the_other_way_around_the_cycle_a_lost_point_comes_back(points, reference):
    moved, quality = accumulate(Formula(shear, lost=(3.0,)), FRAMES, points, reference)
    lost = np.isnan(moved).any(-1)
    np.testing.assert_array_equal(lost[:, 0], np.arange(7) == 3)
    assert (np.isnan(quality) == lost).all()
    np.testing.assert_allclose(moved[6], shear(points, 6.0) - points, atol=1e-12)


def test_around_the_cycle_a_bad_step_counts_as_little_as_its_images_are_alike(points):
    class Slipping(Formula):
        def match(self, first, second, points):
            step, quality = super().match(first, second, points)
            return (step + 1.0, 0.1 + 0 * quality) if (first, second) == (0.0, 1.0) else (step, quality)

    moved, _ = accumulate(Slipping(lambda places, t: places), FRAMES, points, "cycle")
    # Each of the other steps has the variance 1 / 0.5^2 - 1 = 3, the bad one 1 / 0.1^2 - 1 = 99.
    t = np.arange(1, 7)
    forward, backward = 99 + 3 * (t - 1), 3 * (7 - t)
    np.testing.assert_allclose(moved[1:, 0, 0], backward / (forward + backward))


def test_every_image_is_prepared_once(points):
    prepared = []

    class Counted(Formula):
        def prepare(self, image):
            prepared.append(image[0, 0])
            return super().prepare(image)

    accumulate(Counted(shear), FRAMES, points, "previous")
    assert prepared == list(range(7))

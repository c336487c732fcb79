import numpy as np
import pytest

from echotruth.tracking.accumulation import accumulate, follow

FRAMES = np.arange(7.0)[:, None, None] * np.ones((7, 4, 4))
"""Frames whose pixels are the frame number."""


class Formula:
    """Pair tracker of a known motion: position(points at rest, frame number)."""

    def __init__(self, position, lost=()):
        self.position, self.lost = position, lost

    def prepare(self, image):
        return image[0, 0]

    def match(self, first, second, points):
        at_rest = self.position(points, -first)
        step = self.position(at_rest, second) - points
        if second in self.lost:
            step[0] = np.nan
        return step, np.full(len(points), 0.5)


def shear(points, t):
    """Sinking plus shear; its inverse is the motion for -t."""
    sinking = points + [0, 2.0 * t]
    return sinking + np.stack([0.1 * t * (points[:, 1] + t), 0 * points[:, 1]], -1)


@pytest.fixture
def points():
    return np.array([[10.0, 20.0], [30.0, 5.0]])


@pytest.mark.parametrize("reference", ["ED", "previous", "bidirectional"])
def test_steps_are_measured_at_the_current_position_of_the_tissue(points, reference):
    """The displacement is that of the tissue initially at the point, whichever frames are compared."""
    displacement, quality = accumulate(Formula(shear), FRAMES, points, reference)
    truth = np.stack([shear(points, t) - points for t in range(7)])
    np.testing.assert_allclose(displacement, truth, atol=1e-12)
    assert (quality[0] == 1).all() and (quality[1:] == 0.5).all()


def test_frame_to_frame_only_the_lost_point_stays_lost(points):
    displacement, quality = accumulate(Formula(shear, lost=(3.0,)), FRAMES, points, "previous")
    lost = np.isnan(displacement).any(-1)
    np.testing.assert_array_equal(lost[:, 0], np.arange(7) >= 3)
    assert not lost[:, 1].any() and (np.isnan(quality) == lost).all()


@pytest.mark.parametrize("reference", ["ED", "bidirectional"])
def test_against_end_diastole_and_bidirectionally_a_lost_point_comes_back(points, reference):
    displacement, quality = accumulate(Formula(shear, lost=(3.0,)), FRAMES, points, reference)
    lost = np.isnan(displacement).any(-1)
    np.testing.assert_array_equal(lost[:, 0], np.arange(7) == 3)
    assert (np.isnan(quality) == lost).all()
    np.testing.assert_allclose(displacement[6], shear(points, 6.0) - points, atol=1e-12)


def test_way_that_is_known_counts_alone_even_if_a_step_of_it_says_nothing(points):
    class Doubtful(Formula):
        def match(self, first, second, points):
            step, quality = super().match(first, second, points)
            if first == 0 and second == 1:
                quality[:] = 0.0  # forwards, of the first step
            if second == 6:
                step[:] = np.nan  # backwards, all is lost
            return step, quality

    displacement, _ = accumulate(Doubtful(shear), FRAMES, points, "bidirectional")
    truth = np.stack([shear(points, t) - points for t in range(7)])
    np.testing.assert_allclose(displacement[:6], truth[:6], atol=1e-12)


def test_bidirectional_weights_follow_the_correlation_of_each_step(points):
    class Slipping(Formula):
        def match(self, first, second, points):
            step, quality = super().match(first, second, points)
            return (step + 1.0, 0.1 + 0 * quality) if (first, second) == (0.0, 1.0) else (step, quality)

    displacement, _ = accumulate(Slipping(lambda position, t: position), FRAMES, points, "bidirectional")
    # Each of the other steps has the variance 1 / 0.5^2 - 1 = 3, the bad one 1 / 0.1^2 - 1 = 99.
    t = np.arange(1, 7)
    forward, backward = 99 + 3 * (t - 1), 3 * (7 - t)
    np.testing.assert_allclose(displacement[1:, 0, 0], backward / (forward + backward))


def test_disagreement_is_the_distance_of_both_ways_and_variance_that_of_their_mean(points):
    class Slipping(Formula):
        def match(self, first, second, points):
            step, quality = super().match(first, second, points)
            return (step + [3.0, 4.0] if (first, second) == (0.0, 1.0) else step), quality

    path = follow(Slipping(lambda position, t: position), FRAMES, points, "bidirectional")
    np.testing.assert_allclose(path.disagreement[1:], 5.0)
    t = np.arange(1, 7)
    np.testing.assert_allclose(path.variance[1:, 0], 3 * t * (7 - t) / 7)


def test_one_way_has_the_variance_of_its_steps_and_no_disagreement(points):
    for reference, expected in (("previous", 3 * np.arange(7.0)), ("ED", [0.0, *[3.0] * 6])):
        path = follow(Formula(shear), FRAMES, points, reference)
        np.testing.assert_allclose(path.variance[:, 0], expected)
        assert np.isnan(path.disagreement).all()

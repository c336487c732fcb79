import numpy as np

from echotruth.config.tracking import BsplineDic
from echotruth.tracking.bspline_dic import track

SPACING = 25e-6
SIZE = 128
MIDDLE = np.array([63.5, 63.5])


def ring(size=SIZE, inner=22, outer=48):
    """Annulus about the middle of a square image, and points in it."""
    column, row = np.meshgrid(np.arange(size), np.arange(size))
    radius = np.hypot(column - (size - 1) / 2, row - (size - 1) / 2)
    mask = (radius > inner) & (radius < outer)
    points = np.argwhere(mask)[::41, ::-1].astype(float)
    return mask, points


def found(frames, mask, points, **settings):
    return track(frames, points, mask, SPACING, np.arange(len(frames)) * 5e-3, 0, BsplineDic(**settings))


def worst(displacement, frames, points, motion):
    """RMS over the points of the error in the frame where it is largest, px."""
    truth = np.stack([motion(points, t) - points for t in range(frames)])
    return np.sqrt(((displacement - truth) ** 2).sum(-1).mean(1)).max()


def beat(t, frames=6):
    return np.sin(np.pi * t / frames) ** 2


def test_sign_axis_order_and_frame_of_reference_of_a_shift(clip):
    frames = clip(lambda place, t: place + beat(t) * np.array([5, -3]), 6, SIZE)
    mask, points = ring()
    displacement, quality = found(frames, mask, points)
    assert displacement.shape == (6, len(points), 2) and quality.shape == (6, len(points))
    assert (displacement[0] == 0).all() and (quality[0] == 1).all()
    assert worst(displacement, 6, points, lambda place, t: place + beat(t) * np.array([5, -3])) < 0.05
    assert quality.min() > 0.9 and quality.max() <= 1


def test_rotation_and_thickening_are_those_of_the_tissue_at_end_diastole(clip):
    def motion(place, t):
        angle, arm = 0.15 * beat(t), place - MIDDLE
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return MIDDLE + (1 - 0.15 * beat(t)) * arm @ turn + beat(t) * np.array([2, 1])

    mask, points = ring()
    displacement, _ = found(clip(motion, 6, SIZE), mask, points)
    assert np.linalg.norm(motion(points, 3) - points, axis=1).max() > 9
    assert worst(displacement, 6, points, motion) < 0.15

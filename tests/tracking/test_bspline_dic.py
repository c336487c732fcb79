import numba
import numpy as np
import pytest

from echotruth.config.tracking import BsplineDic
from echotruth.tracking import track

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


@pytest.mark.parametrize(("harmonic", "share"), [(2, 0.96), (4, 0.92)])
def test_uneven_contraction_of_a_ring_is_not_evened_out(clip, harmonic, share):
    def inward(place, t):
        arm = place - MIDDLE
        uneven = 1 + 0.4 * np.cos(harmonic * np.arctan2(*arm.T[::-1]))
        return place - 6 * beat(t) * (uneven / np.linalg.norm(arm, axis=1))[:, None] * arm

    mask, points = ring()
    displacement, _ = found(clip(inward, 6, SIZE), mask, points, knots_mm=1e3 * SPACING * 6)
    arm = points - MIDDLE
    radial = (displacement[3] * arm).sum(1) / np.linalg.norm(arm, axis=1)
    even, uneven = np.linalg.lstsq(
        np.stack([np.ones(len(arm)), np.cos(harmonic * np.arctan2(*arm.T[::-1]))], -1), radial, rcond=None
    )[0]
    assert even == pytest.approx(-6, rel=0.02)
    assert share < uneven / -2.4 < 1.1


def test_tissue_in_a_shadow_counts_like_the_rest(clip):
    """The lit side of the ring is at rest, the shadowed side contracts, and noise is as strong everywhere."""

    def inward(place, t):
        arm = place - MIDDLE
        share = np.clip(arm[:, :1] / np.linalg.norm(arm, axis=1)[:, None], 0, None)
        return place - 8 * beat(t) * share * arm / np.linalg.norm(arm, axis=1)[:, None]

    frames = clip(inward, 6, SIZE).astype(int)
    frames -= np.clip(4 * (np.arange(SIZE) - 54), 0, 130)  # 25 dB
    frames = (np.clip(frames, 0, None) + np.random.default_rng(2).integers(0, 4, frames.shape)).astype(np.uint8)
    mask, points = ring()
    shadowed = points[points[:, 0] > 85]
    even, uneven = (found(frames, mask, shadowed, gain_mm=mm)[0] for mm in (0.6, 0))
    assert worst(even, 6, shadowed, inward) < 0.8
    assert worst(uneven, 6, shadowed, inward) > 1.2


@pytest.mark.parametrize("shift", [0.3, 0.5, 0.8])
def test_sub_pixel_shifts_have_a_bias_below_a_hundredth_of_a_pixel(shifted, shift):
    mask, points = ring()
    displacement, _ = found(np.stack([shifted(SIZE, 0, 0), shifted(SIZE, shift, -shift)]), mask, points)
    error = displacement[1] - [shift, -shift]
    assert np.abs(error.mean(0)).max() < 0.01
    assert error.std(0).max() < 0.03


def test_a_step_of_nine_pixels_is_followed(shifted):
    mask, points = ring()
    displacement, _ = found(np.stack([shifted(SIZE, 0, 0), shifted(SIZE, 9, 0)]), mask, points)
    assert np.abs(displacement[1] - [9, 0]).max() < 0.1


def test_sudden_thickening_of_a_part_of_the_wall_is_found_beyond_the_nearest_speckle(speckle):
    size, middle = 192, np.array([95.5, 95.5])

    def inward(place, amount=9):
        arm = place - middle
        radius, angle = np.linalg.norm(arm, axis=1), np.arctan2(*arm.T[::-1])
        inward = amount * np.exp(-(((angle + np.pi / 2) / 0.6) ** 2)) * (80 - radius) / 50
        return place - (inward / np.maximum(radius, 1))[:, None] * arm

    def with_noise(image, seed):
        noise = speckle(size, lambda place: place + np.random.default_rng(seed).normal(0, 30, place.shape), blur=1.5)
        amplitude = np.hypot(*(weight * 10 ** (each / 102) for weight, each in ((1, image), (0.2, noise))))
        return np.clip(102 * np.log10(amplitude), 0, 255).round().astype(np.uint8)

    mask, points = ring(size, 30, 80)
    images = [speckle(size, lambda place: place, blur=1.5), speckle(size, inward, blur=1.5)]
    frames = np.stack([with_noise(image, seed) for seed, image in enumerate(images)])
    displacement, _ = found(frames, mask, points, reference="previous")
    moved = np.linalg.norm(inward(points) - points, axis=1) > 2
    error = (displacement[1] - (inward(points) - points))[moved]
    assert np.sqrt((error**2).sum(1).mean()) < 0.7, "1.3 px if the alignment does not begin with blurred images"


def test_clip_without_texture_has_no_displacement():
    mask, points = ring()
    for value in (0, 200, 0.1, np.nan):
        displacement, quality = found(np.full((3, SIZE, SIZE), value), mask, points)
        assert np.isnan(displacement).all() and np.isnan(quality).all()


def test_part_of_the_wall_without_texture_has_no_displacement_and_the_rest_has(clip):
    frames = clip(lambda place, t: place + beat(t) * np.array([3, 0]), 4, SIZE)
    frames[:, :, 80:] = 0
    mask, points = ring()
    displacement, _ = found(frames, mask, points)
    dark, bright = points[:, 0] > 105, points[:, 0] < 60
    assert dark.any() and np.isnan(displacement[:, dark]).all()
    assert np.abs(displacement[3, bright] - beat(3) * np.array([3, 0])).max() < 0.1


def test_one_black_frame_is_passed_over(clip):
    frames = clip(lambda place, t: place + beat(t) * np.array([3, 1]), 6, SIZE)
    frames[2] = 0
    mask, points = ring()
    displacement, _ = found(frames, mask, points)
    assert np.isnan(displacement[2]).all()
    assert np.abs(displacement[4] - beat(4) * np.array([3, 1])).max() < 0.1


def test_points_beyond_the_wall_and_empty_masks_have_no_displacement(shifted):
    frames = np.stack([shifted(SIZE, 0, 0), shifted(SIZE, 1, 0)])
    mask, points = ring(inner=38, outer=56)
    away = np.array([[2.0, 2.0], [300.0, -5.0], [np.nan, 60.0], MIDDLE])
    displacement, quality = found(frames, mask, away)
    assert np.isnan(displacement).all() and np.isnan(quality).all()
    displacement, quality = found(frames, np.zeros_like(mask), points)
    assert np.isnan(displacement).all() and np.isnan(quality).all()


def test_same_bytes_on_one_thread_and_on_two(clip):
    frames = clip(lambda place, t: place + beat(t) * np.array([2, 1]), 4, SIZE)
    mask, points = ring()
    kept = numba.get_num_threads()
    results = []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        results.append(found(frames, mask, points))
    numba.set_num_threads(kept)
    for one, two in zip(*results, strict=True):
        np.testing.assert_array_equal(one, two)


def test_knots_are_five_pixels_apart_at_least(shifted):
    frames = np.stack([shifted(SIZE, 0, 0), shifted(SIZE, 1, -2)])
    mask, points = ring()
    close, five = (found(frames, mask, points, knots_mm=1e3 * SPACING * knots)[0] for knots in (1, 5))
    np.testing.assert_array_equal(close, five)
    assert np.isfinite(close).all()

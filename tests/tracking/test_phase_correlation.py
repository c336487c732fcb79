import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from echotruth.config import PhaseCorrelation
from echotruth.tracking import grid, track
from echotruth.tracking.trackers import phase_correlation
from echotruth.tracking.windows import arrange


def match(first, second, side, taper="none"):
    tracker = phase_correlation.PhaseCorrelationTracker(arrange(first.shape, side, 0.5), taper, 255)
    return phase_correlation.window_shifts(tracker.prepare(first), tracker.prepare(second), side)


@pytest.mark.parametrize("shift", [(0, 0), (-3, 11)])
def test_sign_and_axis_order_of_a_rolled_image(shift):
    first = np.random.default_rng(1).integers(0, 256, (64, 64)).astype(np.uint8)
    second = np.roll(first, (shift[1], shift[0]), axis=(0, 1))
    moved, peak = match(first, second, 64)
    np.testing.assert_allclose(moved[0, 0], shift, atol=1e-9)
    assert peak[0, 0] == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("taper", ["none", "hann"])
@pytest.mark.parametrize("shift", [0.4, 2.3])
def test_bias_of_sub_pixel_shifts_is_below_a_tenth_of_a_pixel(shifted, shift, taper):
    moved, _ = match(shifted(256, 0, 0), shifted(256, shift, -shift), 64, taper)
    error = moved - [shift, -shift]
    assert np.abs(np.median(error, axis=(0, 1))).max() < 0.1
    assert np.abs(error.mean((0, 1))).max() < 0.12


def test_subpixel_offset_is_exact_for_the_peak_of_a_shifted_texture():
    shift = np.linspace(-0.49, 0.49, 21)
    np.testing.assert_allclose(
        phase_correlation.subpixel_offset(*(np.sinc(k - shift) for k in (-1, 0, 1))), shift, atol=1e-12
    )


@pytest.mark.parametrize("spectral_threshold, found", [(0.0, False), (0.05, True)])
def test_shift_of_noisy_coarse_speckle_is_found_by_the_frequencies_above_a_threshold(spectral_threshold, found):
    """Phase-only correlation gives frequencies that contain only noise the same weight as those of the speckle."""
    rng = np.random.default_rng(3)
    speckle = gaussian_filter(rng.standard_normal((160, 160)), 3, mode="wrap")
    speckle *= 60 / speckle.std()
    frames = [128 + np.roll(speckle, (-3 * t, 2 * t), (0, 1)) + rng.normal(0, 4, speckle.shape) for t in range(2)]
    tracker = PhaseCorrelation(taper="hann", spectral_threshold=spectral_threshold, reference="previous")
    points = grid(speckle.shape, 20).reshape(-1, 2)
    moved, _ = track(np.stack(frames), points, speckle < np.inf, 25e-6, np.arange(2.0), 0, tracker)
    assert (np.median(np.hypot(*(moved[1] - [2, -3]).T)) < 0.3) == found


def test_window_without_texture_has_no_displacement(shifted):
    image = shifted(96, 0, 0)
    image[:, 48:] = 0
    moved, peak = match(image, image, 32)
    assert np.isfinite(moved[:, 0]).all() and np.isnan(moved[:, -1]).all() and np.isnan(peak[:, -1]).all()


def test_window_in_tissue_keeps_its_size():
    tracker = PhaseCorrelation(window_px=None, window_mm=1.5)
    assert [phase_correlation.window_side(tracker, 12e-3 / n) for n in (512, 256, 128)] == [64, 32, 16]
    assert phase_correlation.window_side(tracker, 1e-3) == 8
    assert phase_correlation.window_side(PhaseCorrelation(), 1.0) == 64


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"taper": "hann", "reference": "previous"},
        {"taper": "hann", "reference": "bidirectional", "spectral_threshold": 0.01},
    ],
)
def test_rigid_shift_is_followed_to_half_a_pixel(clip, options):
    frames = clip(lambda place, t: place + np.array([2 * t, -3 * t]), 5)
    points = grid(frames.shape[1:], 20).reshape(-1, 2)
    points = points[(np.abs(points - 79.5) < 50).all(1)]
    moved, _ = track(frames, points, frames[0] >= 0, 25e-6, np.arange(5.0), 0, PhaseCorrelation(**options))
    truth = np.arange(5)[:, None] * np.array([2, -3])
    assert np.abs(moved - truth[:, None]).max() < 0.5


def test_window_larger_than_the_image_is_refused_in_a_sentence():
    frames = np.zeros((2, 40, 80))
    with pytest.raises(ValueError, match="64 px is larger than the image of 40 x 80 px"):
        track(frames, np.zeros((1, 2)), frames[0] == 0, 25e-6, np.arange(2.0), 0, PhaseCorrelation())

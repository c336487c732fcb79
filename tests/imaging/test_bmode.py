"""Envelope, scan conversion, compression and the image sizes."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from echotruth.config import Bmode, Probe
from echotruth.config.imaging import Dropout
from echotruth.imaging.beamforming.scan import Linear, Sector
from echotruth.imaging.bmode import (
    ScanConversion,
    bmode_clip,
    clip_gain,
    downsample,
    dropout_gain,
    eight_bit,
    envelope,
    envelope_images,
    largest_clip,
    log_compress,
    persist,
    pixel_centres,
    sharpened,
    time_gain_compensation,
)

BMODE = Bmode(size_px=128, downsampling=(1, 2, 4))
ANGLE = np.radians(np.linspace(-32, 32, 129))
RANGE = np.linspace(7.7e-6, 13.5e-3, 900)
SECTOR = Sector(ANGLE)


def test_log_compression_by_hand():
    levels = np.array([1, 10 ** (-27.5 / 20), 10 ** (-55 / 20), 1e-6, 0])
    assert np.allclose(log_compress(7 * levels, 55), [1, 0.5, 0, 0, 0])
    assert np.allclose(log_compress(np.array([2.0, 1.0]), 60), [1, 1 - 6.0206 / 60])


@pytest.mark.parametrize(("gain", "expected"), [(10, [1, 1, 0.75, 0.5]), (-10, [0.75, 0.75, 0.25, 0])])
def test_gain_saturates_the_bright_or_loses_the_dark(gain, expected):
    """At 40 dB, echoes at 0, 0, -20 and -30 dB."""
    assert np.allclose(log_compress(np.array([1, 1, 0.1, 10**-1.5]), 40, gain), expected)


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_clip_without_echoes_is_refused(value):
    with pytest.raises(ValueError, match="no echo"):
        log_compress(np.full((1, 4, 4), value), 55)


def test_pixel_centres_fill_the_field_of_view():
    axial, lateral = pixel_centres(Bmode(), 512)
    assert axial[0] == pytest.approx(12e-3 / 1024)
    assert axial[-1] == pytest.approx(12e-3 - 12e-3 / 1024)
    assert np.allclose(lateral, -lateral[::-1])
    assert np.allclose(np.diff(lateral), 12e-3 / 512)


@pytest.mark.parametrize("decibels", [None, 0.7])
def test_gain_undoes_what_attenuation_takes_both_ways(decibels):
    """0.5 dB/cm/MHz at 25 MHz over 1 cm and back is 25 dB; with 0.7 given, 35 dB."""
    probe = Probe(attenuation_dB_per_cm_MHz=0.5)
    gain = time_gain_compensation(probe, Bmode(tgc_dB_per_cm_MHz=decibels), np.array([0, 1e-2]))
    assert np.allclose(20 * np.log10(gain), [0, 25 if decibels is None else 35], atol=1e-4)
    assert np.allclose(envelope(np.array([3 + 4j, 3 + 4j], np.complex64), gain), 5 * gain)


def test_a_gain_beyond_all_numbers_is_refused():
    probe = Probe(preset="mouse_40MHz", attenuation_dB_per_cm_MHz=3.0)
    range_ = np.linspace(1e-3, 0.1, len(RANGE))
    lines = np.ones((1, len(ANGLE), len(RANGE)), np.complex64)
    with pytest.raises(ValueError, match="no echo"):
        bmode_clip(lines, SECTOR, range_, BMODE, time_gain_compensation(probe, BMODE, range_))


def pixel_grid(size):
    axial, lateral = pixel_centres(BMODE, size)
    return axial[:, None], lateral


def test_scan_conversion_puts_a_smooth_field_on_its_place():
    def field(lateral, axial):
        return 2 + np.sin(900 * lateral) * np.cos(700 * axial)

    polar = field(RANGE * np.sin(ANGLE)[:, None], RANGE * np.cos(ANGLE)[:, None])
    image = ScanConversion(SECTOR, RANGE, BMODE)(polar)
    axial, lateral = pixel_grid(128)
    angle, range_ = np.abs(np.arctan2(lateral, axial)), np.hypot(lateral, axial)
    # Splines feel the edge of the sector for a few lines and samples.
    inside = (angle < np.radians(29)) & (range_ > 0.3e-3) & (range_ < 13.2e-3)
    assert np.abs(image - field(lateral, axial))[inside].max() < 1e-4
    assert (image[angle > np.radians(32)] == 0).all()


def test_parallel_lines_are_put_on_their_place():
    origin = np.linspace(-3e-3, 3e-3, 129)
    image = ScanConversion(Linear(origin), RANGE, BMODE)(2 + np.outer(np.sin(900 * origin), np.cos(700 * RANGE)))
    axial, lateral = pixel_grid(128)
    expected = 2 + np.sin(900 * lateral) * np.cos(700 * axial)
    inside = (np.abs(lateral) < 2.7e-3) & (axial > 0.3e-3)
    assert np.abs(image - expected)[inside].max() < 1e-4
    assert (image[:, np.abs(lateral) > 3e-3] == 0).all()


def test_scan_converted_envelope_is_never_negative():
    lines = np.zeros((2, len(ANGLE), len(RANGE)), np.complex64)
    lines[:, 60:64, 400:410] = 1j
    images = envelope_images(lines, SECTOR, RANGE, BMODE)
    assert images.shape == (2, 128, 128)
    assert images.dtype == np.float32
    assert images.min() == 0


def test_downsampling_preserves_the_mean():
    images = np.random.default_rng(0).integers(0, 256, (3, 64, 64), dtype=np.uint8)
    small = downsample(images, 4)
    assert small.shape == (3, 16, 16)
    assert small.dtype == np.uint8
    assert small.mean() == pytest.approx(images.mean(), abs=0.05)
    assert abs(int(small[0, 0, 0]) - images[0, :4, :4].mean()) <= 0.5
    assert downsample(np.array([[1, 2], [3, 4]], np.uint8), 2).tolist() == [[2]]


def test_blocks_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="blocks of 3"):
        downsample(np.zeros((16, 16), np.uint8), 3)


def test_clip_holds_every_size():
    random = np.random.default_rng(1)
    shape = (2, len(ANGLE), len(RANGE))
    lines = (random.standard_normal(shape) + 1j * random.standard_normal(shape)).astype(np.complex64)
    images = bmode_clip(lines, SECTOR, RANGE, BMODE)
    assert {size: frames.shape for size, frames in images.items()} == {n: (2, n, n) for n in (128, 64, 32)}
    assert all(frames.dtype == np.uint8 for frames in images.values())
    assert images[128].max() == 255
    assert (images[32] == downsample(images[128], 4)).all()


def noise_lines(frames):
    random = np.random.default_rng(2)
    shape = (frames, len(ANGLE), len(RANGE))
    return (random.standard_normal(shape) + 1j * random.standard_normal(shape)).astype(np.complex64)


def test_by_default_a_scanner_does_nothing_but_compress():
    """The formula as it was before anything could follow it, to the byte."""
    lines = noise_lines(2)
    images = envelope_images(lines, SECTOR, RANGE, BMODE)
    decibels = 20 * np.log10(np.maximum(images / images.max(), 10 ** (-55 / 20)))
    gain = clip_gain(Probe(), BMODE, (2, len(ANGLE)), RANGE, np.random.default_rng(0))
    clip = largest_clip(lines, SECTOR, RANGE, BMODE, gain)
    assert (clip == np.rint(255 * (1 + decibels / 55)).astype(np.uint8)).all()


def test_time_gain_curve_is_linear_in_decibels_between_its_points():
    bmode = Bmode(time_gain={"range_mm": [2, 6, 10], "gain_dB": [-12, 0, 6]}, tgc_dB_per_cm_MHz=0.2)
    range_ = np.array([1, 2, 4, 8, 12]) * 1e-3
    on_top = time_gain_compensation(Probe(), Bmode(tgc_dB_per_cm_MHz=0.2), range_)
    gain = time_gain_compensation(Probe(), bmode, range_) / on_top
    assert np.allclose(20 * np.log10(gain), [-12, -12, -6, 3, 6], atol=1e-4)


def losses(dropout, seed, frames=1, lines=193, range_=RANGE):
    return -20 * np.log10(dropout_gain(Dropout(**dropout), (frames, lines), range_, np.random.default_rng(seed)))


def test_echoes_drop_out_smoothly_and_in_half_of_the_scan():
    found = np.stack([losses({"loss_dB": 10, "width": 0.1}, seed, range_=RANGE[::9]) for seed in range(200)])
    assert found.min() >= 0
    assert (found > 1e-6).mean() == pytest.approx(0.5, abs=0.02)
    # The positive part of a normal variable has a mean square of a half.
    assert np.sqrt((found**2).mean()) == pytest.approx(10 / np.sqrt(2), rel=0.05)
    # The slope of a process with this correlation has a deviation of 1 / width, over the scan and over the depth.
    for axis, step in ((2, 1 / 192), (3, 9 / len(RANGE))):
        slope = np.diff(found, axis=axis) / step
        assert np.sqrt((slope**2).mean()) == pytest.approx(10 / 0.1 / np.sqrt(2), rel=0.06)


def test_dropout_comes_and_goes_and_returns_with_the_cycle():
    found = losses({"loss_dB": 10}, 3, frames=48, lines=33, range_=RANGE[::50])
    change = np.abs(found - np.roll(found, 1, axis=0)).mean(axis=(1, 2))
    assert change[0] < 2.5 * change.mean(), "from the last frame to the first as from any to the next"
    assert np.abs(found[24] - found[0]).mean() > 3 * change.mean()


def test_dropout_does_not_depend_on_the_sampling_and_keeps_the_time_gain():
    bmode = Bmode(dropout={"loss_dB": 10}, tgc_dB_per_cm_MHz=0.2)
    fine, coarse = (clip_gain(Probe(), bmode, shape, RANGE, np.random.default_rng(5)) for shape in ((4, 257), (2, 65)))
    assert np.allclose(fine[::2, ::4], coarse, rtol=1e-5)
    assert np.allclose(fine.max(axis=(0, 1)), time_gain_compensation(Probe(), bmode, RANGE), rtol=1e-4)


def test_edges_lose_most_at_the_end_and_nothing_at_the_array():
    found = losses({"edge_loss_dB": 30}, 0, lines=5, range_=np.linspace(0, 10e-3, 11))[0]
    assert np.allclose(found[0], 30 * np.linspace(0, 1, 11) ** 2, atol=1e-4) and np.allclose(found[0], found[4])
    assert np.allclose(found[2], 0, atol=1e-5) and np.allclose(found[1], found[0] / 4, atol=1e-4)


def test_edges_are_enhanced_within_the_scan_alone():
    inside = np.zeros((60, 60), bool)
    inside[10:50, 10:50] = True
    flat = np.where(inside, 0.5, 0.0)
    assert np.allclose(sharpened(flat, inside, 2.0, 3.0), flat)
    step = np.where(inside, np.where(np.arange(60) < 30, 0.3, 0.7), 0.0)
    sharp = sharpened(step, inside, 1.0, 2.0)
    assert np.allclose(sharp[30, [12, 47]], [0.3, 0.7], atol=1e-6)
    # Half a pixel beside a step of 0.4 its Gaussian mean is 0.2 erf(0.5 / (2 sqrt 2)) from the middle.
    assert sharp[30, [29, 30]] == pytest.approx([0.1 + 0.0395, 0.9 - 0.0395], abs=2e-3)
    assert (sharp[~inside] == 0).all()


def test_smoothing_is_within_the_scan_alone():
    inside = np.zeros((60, 60), bool)
    inside[10:50, 10:50] = True
    noise = np.where(inside, np.random.default_rng(1).random((60, 60)), 0.0)
    mean = sharpened(noise, inside, -1.0, 2.0)
    # White noise averaged by a Gaussian of standard deviation s keeps 1 / (4 pi s^2) of its variance.
    middle = np.s_[16:44, 16:44]
    assert mean[middle].std() == pytest.approx(noise[middle].std() / np.sqrt(16 * np.pi), rel=0.25)
    assert mean[middle].mean() == pytest.approx(noise[middle].mean(), abs=0.02)
    half = sharpened(noise, inside, -0.5, 2.0)
    assert np.allclose(half, (noise + mean) / 2) and (half[~inside] == 0).all()


def test_grey_maps_keep_black_and_white_and_what_is_beyond():
    levels = np.array([-0.2, 0, 0.25, 0.5, 1, 1.3])
    assert eight_bit(levels, Bmode()).tolist() == [0, 0, 64, 128, 255, 255]
    # 3 / 16 - 2 / 64 = 0.156
    assert eight_bit(levels, Bmode(grey_map="s_curve")).tolist() == [0, 0, 40, 128, 255, 255]
    assert eight_bit(levels, Bmode(grey_gamma=2.0)).tolist() == [0, 0, 16, 64, 255, 255]


def test_persistence_acts_on_compressed_images_and_the_grey_map_comes_last():
    lines = noise_lines(3)
    images = envelope_images(lines, SECTOR, RANGE, BMODE)
    levels = np.maximum(1 + (20 * np.log10(np.maximum(images / images.max(), 1e-9)) + 6) / 55, 0).clip(0, 1)
    # Three frames in a circle, each with half of the one before: weights 4 / 7, 2 / 7, 1 / 7.
    shown = (4 * levels + 2 * np.roll(levels, 1, axis=0) + np.roll(levels, 2, axis=0)) / 7
    keys = {"persistence": 0.5, "grey_map": "s_curve", "gain_dB": 6.0}
    clip = largest_clip(lines, SECTOR, RANGE, BMODE.model_copy(update=keys))
    assert np.abs(clip - 255 * (3 * shown**2 - 2 * shown**3)).max() < 0.51


def test_persistence_of_an_open_clip_begins_with_its_first_image():
    first, second, third = levels = np.random.default_rng(0).random((3, 2, 2))
    shown = persist(levels, 0.5, is_closed=False)
    expected = [first, (first + second) / 2, (first + second) / 4 + third / 2]
    np.testing.assert_allclose(shown, expected, rtol=1e-15)


def test_a_clip_is_smoothed_before_its_edges_are_enhanced():
    """Both are convolutions far from the edge of the scan: an unsharp mask of a mean is a difference of Gaussians."""
    lines = noise_lines(1)
    keys = {"smoothing": 1.0, "smoothing_width_px": 3.0, "edge_enhancement": 2.0, "edge_width_px": 4.0}
    images = envelope_images(lines, SECTOR, RANGE, BMODE)
    level = log_compress(images, BMODE.dynamic_range_dB)[0].astype(float)
    narrow, wide = (gaussian_filter(level, width) for width in (3.0, 5.0))
    clip = largest_clip(lines, SECTOR, RANGE, BMODE.model_copy(update=keys))[0]
    middle = np.s_[50:90, 54:74]
    assert np.abs(clip - 255 * (3 * narrow - 2 * wide).clip(0, 1))[middle].max() < 1.5

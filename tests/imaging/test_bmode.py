"""Envelope, scan conversion, compression and the image sizes."""

import numpy as np
import pytest

from echotruth.config import Bmode, Probe
from echotruth.imaging.beamforming.scan import Linear, Sector
from echotruth.imaging.bmode import (
    ScanConversion,
    bmode_clip,
    downsample,
    envelope,
    envelope_images,
    log_compress,
    pixel_centres,
    time_gain_compensation,
)

BMODE = Bmode(size_px=128, downsampling=(1, 2, 4))
ANGLE = np.radians(np.linspace(-32, 32, 129))
RANGE = np.linspace(7.7e-6, 13.5e-3, 900)
SECTOR = Sector(ANGLE)


def test_envelope_is_the_magnitude():
    found = envelope(np.array([[3 + 4j, -2j]], np.complex64))
    assert found.dtype == np.float32
    assert np.allclose(found, [[5, 2]])


def test_log_compression_by_hand():
    levels = np.array([1, 10 ** (-27.5 / 20), 10 ** (-55 / 20), 1e-6, 0])
    assert log_compress(7 * levels, 55).tolist() == [255, 128, 0, 0, 0]
    assert log_compress(np.array([2.0, 1.0]), 60).tolist() == [255, round(255 * (1 - 6.0206 / 60))]


def test_one_reference_serves_the_whole_clip():
    images = np.array([[[1.0]], [[0.1]]])
    assert log_compress(images, 40).ravel().tolist() == [255, 128]


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


def test_small_pixels_share_centres_with_their_blocks():
    for fine, coarse in zip(pixel_centres(Bmode(), 512), pixel_centres(Bmode(), 128), strict=True):
        assert np.allclose(fine.reshape(128, 4).mean(axis=1), coarse)


@pytest.mark.parametrize("decibels", [None, 0.7])
def test_gain_undoes_what_attenuation_takes_both_ways(decibels):
    """0.5 dB/cm/MHz at 25 MHz over 1 cm and back is 25 dB; with 0.7 given, 35 dB."""
    probe = Probe(attenuation_dB_per_cm_MHz=0.5)
    gain = time_gain_compensation(probe, Bmode(tgc_dB_per_cm_MHz=decibels), np.array([0, 1e-2]))
    assert np.allclose(20 * np.log10(gain), [0, 25 if decibels is None else 35], atol=1e-4)
    assert np.allclose(envelope(np.array([3 + 4j, 3 + 4j], np.complex64), gain), 5 * gain)


def test_without_attenuation_there_is_no_gain():
    assert (time_gain_compensation(Probe(), Bmode(), RANGE) == 1).all()


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


def test_scan_conversion_turns_the_smallest_angle_to_the_first_columns():
    polar = np.zeros((len(ANGLE), len(RANGE)), np.float32)
    polar[:20] = 1
    image = ScanConversion(SECTOR, RANGE, BMODE)(polar)
    assert image[:, :64].sum() > 0
    assert image[:, 64:].max() < 1e-3


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

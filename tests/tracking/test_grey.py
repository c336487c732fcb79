import numpy as np
import pytest

from echotruth.config.tracking import PhaseCorrelation, WindowDeformation
from echotruth.tracking import track
from echotruth.tracking.grey import MIN_GAIN_DB, MIN_STD, decompress, even_gain, grey_levels, local_ncc, rms


def test_local_ncc_is_pearson_s_correlation_of_the_two_squares():
    first, second = np.random.default_rng(2).uniform(size=(2, 30, 40))
    second += 0.8 * first
    found = local_ncc(first, second, 7)
    for row, column in ((3, 3), (15, 20), (26, 36)):
        squares = (image[row - 3 : row + 4, column - 3 : column + 4].ravel() for image in (first, second))
        assert found[row, column] == pytest.approx(np.corrcoef(*squares)[0, 1], abs=1e-9)


def test_square_that_holds_no_texture_or_an_unknown_pixel_has_no_ncc():
    image = np.random.default_rng(2).uniform(size=(20, 40))
    image[:, 20:] = 0.5 + 0.9 * MIN_STD * np.where(np.indices((20, 20)).sum(0) % 2, 1, -1)
    image[4, 4] = np.nan
    known = np.isfinite(local_ncc(image, image, 5))
    np.testing.assert_array_equal(known[4, 7:18], True)
    assert not known[2:7, 2:7].any() and not known[:, 23:].any()


@pytest.mark.parametrize("kind", [np.uint16, np.int32, float])
def test_any_type_is_brought_to_the_range_from_0_to_1(kind):
    frames = np.array([[[20, 120], [70, 20]]], kind)
    np.testing.assert_allclose(grey_levels(frames), [[[0, 1], [0.5, 0]]], atol=1e-7)


def test_eight_bits_keep_their_levels():
    np.testing.assert_allclose(grey_levels(np.array([[[51, 102]]], np.uint8)), [[[0.2, 0.4]]], atol=1e-7)


def test_what_is_not_finite_is_unknown_and_does_not_set_the_range():
    frames = grey_levels(np.array([[[0, 5.0, np.inf, np.nan]]]))
    np.testing.assert_array_equal(frames, [[[0, 1, np.nan, np.nan]]])
    assert np.isnan(grey_levels(np.full((1, 2, 2), np.nan))).all() and (grey_levels(np.full((1, 2, 2), 3.0)) == 0).all()


def test_decompression_inverts_the_log_compression():
    echo = np.array([0.01, 0.1, 1.0])
    shown = 1 + 20 * np.log10(echo) / 40
    found = decompress(shown, 40.0)
    np.testing.assert_allclose(np.diff(found) / np.diff(echo), np.diff(found)[0] / np.diff(echo)[0], rtol=1e-12)
    assert decompress(np.array(1e-6), 40.0) == pytest.approx(1e-6, rel=1e-5)
    np.testing.assert_array_equal(decompress(shown, 0.0), shown)


def test_even_gain_removes_a_shadow_and_leaves_black_black():
    speckle = np.random.default_rng(1).rayleigh(size=(200, 240)).astype(np.float32)
    speckle[::7] = 0
    shadow = 10 ** (-1 / (1 + np.exp((np.arange(240) - 120) / 12))).astype(np.float32)  # 20 dB on the left
    lit, dim = (even_gain(image, 15.0, rms(speckle[speckle > 0])) for image in (speckle, shadow * speckle))
    left = np.s_[:, :60]
    floor = 10 ** (MIN_GAIN_DB / 10)
    assert rms(dim[left]) / rms(lit[left]) == pytest.approx(np.sqrt((1 + floor) / (1 + floor / 0.01)), abs=0.02)
    assert rms((shadow * speckle)[left]) / rms(speckle[left]) < 0.2
    assert (dim[::7] == 0).all()
    assert rms(lit) / rms(speckle) == pytest.approx(1, abs=0.03)
    np.testing.assert_array_equal(even_gain(speckle, 15.0, 0.0), speckle)


@pytest.mark.parametrize("section", [PhaseCorrelation, WindowDeformation])
def test_tracker_with_a_dynamic_range_follows_the_amplitudes(clip, section):
    """As if it were given a clip of the amplitudes, in any unit; the grey values give another track."""
    frames, along = clip(lambda place, t: place + t * np.array([1.3, -0.6]), 2), np.arange(40, 121, 20.0)
    points = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    own = {"taper": "hann", "spectral_threshold": 0.01} if section is PhaseCorrelation else {}

    def moved(frames, decibels):
        settings = section(reference="previous", dynamic_range_dB=decibels, **own)
        return track(frames, points, np.ones((160, 160), bool), 5e-5, np.arange(2.0), 1, settings)[0][1]

    found = moved(frames, 50.0)
    np.testing.assert_allclose(found, moved(decompress(grey_levels(frames), 50.0), 0.0), atol=2e-3)
    assert np.abs(found - moved(frames, 0.0)).max() > 0.02

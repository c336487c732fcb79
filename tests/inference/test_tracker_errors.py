"""The error of a tracker, from errors that are drawn with a known one."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

import echotruth as et
from echotruth.inference import tracker_errors
from echotruth.inference.tracker_errors import NoErrors

ABOUT = ("mine", 256, "ideal", "circumferential")
SEGMENTS = 6


def heart(random, common=0.01, own=0.03, gain=1.0, unevenness=0.0):
    """What was tracked of a heart and what is true: half of the walls are uneven."""
    true = -0.15 + random.choice([0.02, 0.1]) * random.normal(size=SEGMENTS)
    apart = true - np.mean(true)
    spread = np.hypot(own, np.sqrt(unevenness) * np.std(true, ddof=1))
    error = spread * random.normal(size=SEGMENTS)
    return np.mean(true) + 0.02 + common * random.normal() + gain * apart + error - np.mean(error), true


def table(random, hearts, **errors):
    rows = ((*ABOUT, f"heart{number}", "case", "mid", *heart(random, **errors)) for number in range(hearts))
    return tracker_errors.table_of(rows)


@pytest.mark.parametrize("unevenness", [0.0, 0.1])
@pytest.mark.parametrize("gain", [1.0, 0.7])
def test_bias_gain_and_variances_of_many_hearts_are_those_they_were_drawn_with(gain, unevenness):
    drawn = table(np.random.default_rng(1), 3000, own=0.01, gain=gain, unevenness=unevenness)
    found = tracker_errors.error_of(drawn, *ABOUT, "another")
    assert found.bias == pytest.approx(0.02, abs=1e-3)
    assert found.common_sd == pytest.approx(0.01, rel=0.1)
    assert found.gain == pytest.approx(gain, abs=0.01)
    assert found.segment_variance == pytest.approx(1e-4, rel=0.2)
    assert found.unevenness == pytest.approx(unevenness, abs=0.01)
    alike, apart = np.full(SEGMENTS, 0.2), gain * np.array([-0.1, 0.0, 0.1, -0.1, 0.0, 0.1])
    due = (1e-4 + unevenness * np.array([0.0, 8e-3])) / gain**2  # of each segment, less what is of the mean
    for tracked, own in zip((alike, apart), due, strict=True):
        row = [1e-4 + own * 5 / 6, *np.full(SEGMENTS - 1, 1e-4 - own / 6)]
        np.testing.assert_allclose(found.covariance(tracked)[0], row, atol=0.15 * own + 1e-5)


@pytest.mark.parametrize("common", [0.03, 0.003])
@pytest.mark.parametrize("hearts", [3, 8])
def test_intervals_of_few_hearts_are_wide_enough_for_the_next_one(hearts, common):
    drawn = {"common": common, "own": 0.01, "gain": 0.7}
    random, of_mean, of_segment = np.random.default_rng(hearts), [], []
    for _ in range(300):
        found = tracker_errors.error_of(table(random, hearts, **drawn), *ABOUT, "another")
        tracked, true = heart(random, **drawn)
        error, covariance = found.corrected(tracked) - true, found.covariance(tracked)
        of_mean.append(abs(np.mean(error)) < norm.ppf(0.95) * np.sqrt(np.mean(covariance)))
        of_segment.append(np.abs(error) < norm.ppf(0.95) * np.sqrt(np.diag(covariance)))
    assert 0.84 < np.mean(of_mean) < 0.96
    assert 0.84 < np.mean(of_segment) < 0.98


def test_correction_leaves_no_error_that_grows_with_how_much_segments_differ():
    """What is inferred from has the contrast of the truth, whichever the hearts are that the errors were learned on."""
    random = np.random.default_rng(5)
    found = tracker_errors.error_of(table(random, 200, gain=0.7, own=0.02), *ABOUT, "another")
    true = np.array([-0.02, -0.05, -0.2, -0.2, -0.18, -0.19])
    apart = true - true.mean()
    tracked = [true.mean() + 0.7 * apart + 0.02 * random.normal(size=SEGMENTS) for _ in range(2000)]
    mean = np.mean([found.corrected(one) for one in tracked], axis=0)
    np.testing.assert_allclose(mean - mean.mean(), apart, atol=0.006)


def test_view_that_shows_fewer_segments_tells_the_mean_less_well():
    found = tracker_errors.error_of(table(np.random.default_rng(1), 100), *ABOUT, "another")
    all_, few = (np.mean(found.covariance(np.full(number, -0.15))) for number in (SEGMENTS, 2))
    assert all_ == pytest.approx(found.common_sd**2)
    assert few == pytest.approx(found.common_sd**2 + found.segment_variance * (1 / 2 - 1 / 6) / found.gain**2)


def test_tracker_that_shows_no_contrast_tells_next_to_nothing_of_it():
    found = tracker_errors.error_of(table(np.random.default_rng(1), 50, gain=0.0, own=0.02), *ABOUT, "another")
    assert found.gain == tracker_errors.LEAST_GAIN
    assert np.sqrt(found.covariance(np.full(SEGMENTS, -0.15))[0, 0]) > 0.15


def test_several_clips_of_a_heart_are_one_heart():
    random = np.random.default_rng(2)
    once = table(random, 4)
    twice = pd.concat([once, once.assign(view="basal")], ignore_index=True)
    one, two = (tracker_errors.error_of(rows, *ABOUT, "another") for rows in (once, twice))
    assert two.common_sd == pytest.approx(one.common_sd) and two.bias == pytest.approx(one.bias)
    single = twice[twice["heart"] == "heart0"]
    with pytest.raises(NoErrors, match="of 1 hearts"):
        tracker_errors.error_of(single, *ABOUT, "another")


def test_errors_of_the_heart_itself_do_not_count():
    rows = table(np.random.default_rng(3), 3)
    rows.loc[rows["heart"] == "heart0", "mean"] = 5.0
    assert tracker_errors.error_of(rows, *ABOUT, "heart0").bias < 0.1
    assert tracker_errors.error_of(rows, *ABOUT, "heart1").bias > 1


def test_tracker_without_errors_is_refused_with_what_is_known():
    rows = table(np.random.default_rng(3), 3)
    with pytest.raises(NoErrors, match=r"other at 256 px .* of 0 hearts: known are mine"):
        tracker_errors.error_of(rows, "other", *ABOUT[1:], "heart0")
    with pytest.raises(NoErrors, match=r"mine at 512 px .* of 0 hearts: it is known at 256 px ideal"):
        tracker_errors.error_of(rows, "mine", 512, *ABOUT[2:], "heart0")
    with pytest.raises(NoErrors, match="of 1 hearts"):
        tracker_errors.error_of(rows[rows["heart"] != "heart2"], *ABOUT, "heart0")


def test_table_is_written_and_read_and_one_that_is_none_is_refused(tmp_path):
    rows, path = table(np.random.default_rng(4), 3), tmp_path / "errors.csv"
    rows.to_csv(path, index=False)
    assert tracker_errors.read(path).equals(rows)
    for name, text, said in (
        ("empty", "", "is no table"),
        ("columns", "tracker,mean\nmine,1\n", "has no column size_px"),
        ("text", rows.to_csv(index=False).replace("256", "big"), "row 1: size_px is big"),
        ("sd", rows.assign(true_sd=-0.1).to_csv(index=False), "row 1: true_sd is -0.1"),
        ("correlation", rows.assign(correlation=2).to_csv(index=False), "row 1: correlation is 2"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(NoErrors, match=said):
            tracker_errors.read(tmp_path / name)
    with pytest.raises(NoErrors, match="there is no such table"):
        tracker_errors.read(tmp_path / "nowhere.csv")


def test_images_of_which_more_than_muscle_blood_and_borders_is_seen_are_realistic():
    for given in ({}, {"blood.level_dB": -20.0, "borders.endocardium_dB": 10.0, "shadow.edge_deg": 3.0}):
        assert (
            tracker_errors.acoustics(et.configure(**{f"realism.{key}": value for key, value in given.items()}))
            == "ideal"
        )
    for key, value in (
        ("noise.snr_dB", 20.0),
        ("haze.level_dB", -20.0),
        ("surroundings.level_dB", -10.0),
        ("decorrelation.time_ms", 5.0),
        ("neighbours.papillary_muscles_dB", 0.0),
        ("backscatter.variation_dB", 3.0),
        ("shadow.side", "left"),
    ):
        assert tracker_errors.acoustics(et.configure(**{f"realism.{key}": value})) == "realistic"
    assert tracker_errors.acoustics(et.configure(realism={"preset": "mouse"})) == "realistic"

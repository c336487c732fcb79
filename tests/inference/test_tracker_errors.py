"""The error of a tracker, from errors that are drawn with a known one."""

import numpy as np
import pytest
from scipy.stats import norm

import echotruth as et
from echotruth.inference import tracker_errors
from echotruth.inference.tracker_errors import NoErrors

ABOUT = ("mine", 256, "ideal", "circumferential")


def table(random, hearts, bias=0.02, common=0.01, own=0.03, smoothing=0.0, segments=6):
    rows = []
    for number in range(hearts):
        true = random.choice([0.02, 0.1]) * random.normal(size=segments)
        spread = np.hypot(own, np.sqrt(smoothing) * np.std(true, ddof=1))
        error = bias + common * random.normal() + spread * random.normal(size=segments)
        rows.append((*ABOUT, f"heart{number}", true + error, true))
    return tracker_errors.table_of(rows)


@pytest.mark.parametrize("smoothing", [0.0, 0.1])
def test_bias_and_variances_of_many_hearts_are_those_they_were_drawn_with(smoothing):
    drawn = table(np.random.default_rng(1), 3000, own=0.01, smoothing=smoothing)
    found = tracker_errors.error_of(drawn, *ABOUT, "another")
    assert found.bias == pytest.approx(0.02, abs=1e-3)
    assert found.common_sd == pytest.approx(0.01, rel=0.1)
    assert found.smoothing == pytest.approx(smoothing, abs=0.01)
    alike, apart = np.full(3, 0.2), np.array([-0.1, 0.0, 0.1])
    np.testing.assert_allclose(found.covariance(alike)[0], [2e-4, 1e-4, 1e-4], rtol=0.3)
    np.testing.assert_allclose(found.covariance(apart)[0, 0], 2e-4 + smoothing * 1e-2, rtol=0.15)


@pytest.mark.parametrize("hearts", [3, 6])
def test_intervals_of_few_hearts_are_wide_enough_for_the_next_one(hearts):
    random, inside = np.random.default_rng(hearts), []
    for _ in range(300):
        found = tracker_errors.error_of(table(random, hearts, common=0.03, own=0.01), *ABOUT, "another")
        new = 0.02 + 0.03 * random.normal() + 0.01 * random.normal(size=6)
        sd = np.sqrt(np.mean(found.covariance(np.zeros(6))))
        inside.append(abs(np.mean(new) - found.bias) < norm.ppf(0.95) * sd)
    assert 0.84 < np.mean(inside) < 0.96


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
        ("sd", rows.assign(sd=-0.1).to_csv(index=False), "row 1: sd is -0.1"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(NoErrors, match=said):
            tracker_errors.read(tmp_path / name)
    with pytest.raises(NoErrors, match="there is no such table"):
        tracker_errors.read(tmp_path / "nowhere.csv")


def test_images_with_noise_surroundings_or_a_shadow_are_realistic():
    assert tracker_errors.acoustics(et.configure()) == "ideal"
    for key, value in (("noise.snr_dB", 20.0), ("surroundings.level_dB", -10.0), ("shadow.side", "left")):
        assert tracker_errors.acoustics(et.configure(**{f"realism.{key}": value})) == "realistic"

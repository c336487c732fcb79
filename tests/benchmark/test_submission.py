"""Submissions: an honest one passes the checks, those that look the truth up are caught; cards; variants of clips."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from finished_repository import made_otherwise

from benchmarks.suite import checks, results
from benchmarks.suite.card import Card, attach, attach_card, card_of, read
from benchmarks.suite.page import EXAMPLE, Page
from benchmarks.suite.rerun import prepare_rerun, rerun
from benchmarks.suite.results import result_path
from benchmarks.suite.variants import VARIANTS, anonymous
from echotruth.config.loading import load
from echotruth.config.reading import ConfigError
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.run import prepare
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository import estimates
from echotruth.repository.reader import Repository

pytestmark = pytest.mark.slow


def test_honest_tracker_passes_and_is_as_good_on_mirrored_clips(page):
    verdict = page.verdict("honest")
    assert verdict.flags == [] and verdict.mirrored.hearts == verdict.clips == 2
    assert verdict.mirrored.value == pytest.approx(1, abs=0.2)
    assert verdict.gap == pytest.approx(1)  # all hearts move alike
    assert page.verdict("submissions:honest").tracker == "submissions_honest"


def test_tracker_that_looks_the_truth_up_is_caught(page):
    name = "reading"
    verdict = page.verdict(name)
    assert verdict.flags == ["worse on mirrored clips", "impossible accuracy"]
    assert verdict.mirrored.low > 100 and verdict.impossible == verdict.clips == 2
    assert name not in page.order and page.withheld[name] == "worse on mirrored clips; impossible accuracy"


def test_tracker_does_not_find_the_truth_in_its_process(repository, evaluate_submission):
    scores = evaluate_submission(repository, "spying", [])
    assert len(scores) == 3 and np.allclose(scores["nrmse_all_percent"], 100)  # it has found nothing that moves


def result_of(folder, tracker, variant):
    """Rows of the clips that count, and the number of older ones."""
    return results.result_of(Repository(folder), tracker, variant)


def test_scores_on_mirrored_clips_of_older_images_do_not_count(repository):
    assert len(result_of(repository, "honest", "mirrored").rows) == 2
    made_otherwise(repository / "bench.zarr/clips/a_ideal/mid/bmode/64")
    found = result_of(repository, "honest", "mirrored")
    assert list(found.rows["case"]) == ["b_ideal"] and found.older == 1
    result_path(repository, "honest", "mirrored").write_text("[1, 2")
    with pytest.raises(ValueError, match=r"honest\.mirrored\.json: is not what was written: delete it"):
        result_of(repository, "honest", "mirrored")


def test_scores_on_mirrored_clips_go_when_the_tracker_is_evaluated_again(repository):
    prepare(Repository(repository), "honest", {"method": "dis"}).write([])
    assert result_of(repository, "honest", "mirrored").rows.empty
    assert len(result_of(repository, "reading", "mirrored").rows) == 2


def test_scores_with_older_settings_of_a_tracker_of_the_repository_do_not_count_and_are_made_again(repository, page):
    list(rerun([repository], "dis", "mirrored", "test", []))
    config = repository / "config.yaml"
    values = yaml.safe_load(config.read_text())
    values["tracking"]["trackers"]["dis"]["preset"] = "fine"
    config.write_text(yaml.safe_dump(values))
    suites = [replace(page.whole.suites[0], repository=Repository(repository))]
    verdict = checks.verdict("dis", replace(page.whole, suites=suites), "test")
    assert verdict.mirrored is None and verdict.older == 2
    assert "2 older results on mirrored clips do not count: check it again" in verdict.text
    list(rerun([repository], "dis", "mirrored", "test", []))
    again = checks.verdict("dis", replace(page.whole, suites=suites), "test")
    assert again.words == "nothing found" and again.older == 0 and again.mirrored.hearts == 2


def test_check_of_one_half_leaves_that_of_the_other_and_the_verdict_says_what_was_checked(repository, page):
    suites = [replace(page.whole.suites[0], repository=Repository(repository))]
    list(rerun([repository], "dis", "mirrored", "develop", []))
    assert checks.verdict("dis", replace(page.whole, suites=suites), "test").words.endswith("not run on mirrored clips")
    list(rerun([repository], "dis", "mirrored", "test", []))
    found = result_of(repository, "dis", "mirrored").rows
    assert list(found["case"]) == ["a_ideal", "b_ideal", "c_ideal"]
    for split, hearts in (("test", 2), ("develop", 1)):
        verdict = checks.verdict("dis", replace(page.whole, suites=suites), split)
        assert verdict.words == "nothing found" and verdict.mirrored.hearts == hearts


def test_ratio_says_of_which_clips_and_sizes_it_is():
    keys = pd.DataFrame({"repository": "one", "case": list("abab"), "view": "mid", "size_px": [128, 128, 64, 64]})
    again = keys.assign(error_percent=2.0, before_percent=1.0)
    parts = [checks.paired_ratio(keys.assign(heart=keys["case"]), again[:count]).part for count in (1, 2, 3, 4)]
    assert parts == ["1 of 4 clips (128 px)", "2 of 4 clips (128 px)", "3 of 4 clips", ""]


def test_a_tracker_is_given_neither_seed_nor_times_by_which_it_would_know_the_clip(repository, monkeypatch):
    given = []
    monkeypatch.setattr(
        "echotruth.evaluation.run.track", lambda *arguments: given.append(arguments) or missing(arguments)
    )
    run = prepare_rerun(Repository(repository), "dis", "mirrored", "test")
    list(run.rows([64]))
    known = [read_clips(Repository(repository), case, view)[64] for case, view in run.case_views()]
    times, seeds = ([arguments[k] for arguments in given] for k in (4, 5))
    assert not np.array_equal(known[0].frame_time, known[1].frame_time) and known[0].seed != known[1].seed
    # These clips have the same images, so that nothing is left that differs.
    assert np.array_equal(*times) and seeds[0] == seeds[1] and not {clip.seed for clip in known} & set(seeds)
    assert all(np.array_equal(*each) for each in zip(*(arguments[:4] for arguments in given), strict=True))


def missing(arguments):
    """An estimate without values."""
    shape = len(arguments[0]), len(arguments[1])
    return np.full((*shape, 2), np.nan), np.full(shape, np.nan)


def test_seed_of_an_anonymous_clip_is_that_of_its_images(clip):
    time = np.arange(12) * 2.0
    other = replace(clip, seed=99, frame_time=clip.frame_time * 3)
    first, second = anonymous(clip, time), anonymous(other, time)
    assert first.seed == second.seed != anonymous(replace(clip, frames=clip.frames[..., ::-1]), time).seed
    assert np.array_equal(first.frame_time, time[:9]) and np.array_equal(second.frame_time, time[:9])


def test_error_of_an_open_clip_is_that_of_its_last_frame(repository):
    lines = list(rerun([repository], "dis", "open", "test", []))
    found = result_of(repository, "dis", "open").rows
    found_before = estimates.tracked(Repository(repository), "a_ideal", "mid", "dis", 64, "frame_nrmse")
    stored = found_before["frame_nrmse"][1, -1]  # one of two steps
    assert len(lines) == 2 and found["before_percent"][0] == pytest.approx(100 * stored, rel=1e-3)
    assert np.all(found["error_percent"] < 10)


@pytest.fixture
def clip():
    random = np.random.default_rng(1)
    size, frames = 24, 9
    inside = random.random((5, 4)) < 0.6
    points = random.uniform(2, size - 3, (int(inside.sum()), 2))
    images = random.integers(256, size=(frames, size, size)).astype(np.uint8)
    return Clip(images, random.random((size, size)) < 0.5, inside, points, 1e-4, np.arange(frames) * 1e-2, 3, 2)


def bright(frames, points, mask):
    """A tracker that sees its left from its right: the grey level at the point, across and down."""
    column, row = np.rint(points).astype(int).T
    return np.stack([frames[:, row, column] * 1.0, mask[row, column] * np.ones((len(frames), 1))], -1)


def test_displacement_found_in_a_mirrored_clip_comes_back_with_its_point_and_its_sign(clip):
    mirror = VARIANTS["mirrored"](clip)
    frames, points, mask, *_ = mirror.clip.tracker_arguments
    restored, quality = mirror.restored(bright(frames, points, mask), np.ones((len(frames), len(points))))
    expected = bright(clip.frames[::2], clip.points, clip.mask)
    assert np.array_equal(restored, expected * [-1, 1]) and np.all(quality == 1)
    assert np.all(np.diff(points[:, 1]) >= 0)  # in rows, as the points of any clip


def test_open_clip_has_the_first_half_of_the_frames_and_nothing_is_known_of_the_rest(clip):
    half = VARIANTS["open"](clip)
    frames, points, mask, _, times, _ = half.clip.tracker_arguments
    assert np.array_equal(frames, clip.frames[:5:2]) and np.array_equal(times, clip.frame_time[:5:2])
    restored, _ = half.restored(bright(frames, points, mask), np.ones((3, len(points))))
    assert np.isfinite(restored[:3]).all() and np.isnan(restored[3:]).all() and len(restored) == 5
    assert half.last == 4


@pytest.mark.parametrize(
    ("errors", "again", "flagged"),
    [
        ([4, 5, 6, 5], [4.1, 4.9, 6.2, 5.1], False),
        ([4, 5, 6, 5], [8, 9, 13, 9], True),
        ([4, 5, 6, 5], [40, 5, 6, 5], False),
    ],
)
def test_ratio_is_the_geometric_mean_over_hearts_and_flagged_beyond_its_interval(errors, again, flagged):
    keys = {"repository": "one", "case": list("abcd"), "view": "mid", "size_px": 128}
    clips = pd.DataFrame(keys | {"heart": list("abcd")})
    ratio = checks.paired_ratio(clips, pd.DataFrame(keys | {"error_percent": again, "before_percent": errors}))
    assert ratio.value == pytest.approx(np.prod(np.array(again) / errors) ** 0.25)
    assert ratio.low < ratio.value < ratio.high and checks.is_worse(ratio) is flagged


def test_card_is_kept_beside_the_scores(repository, tmp_path):
    file = tmp_path / "card.yaml"
    file.write_text(yaml.safe_dump(EXAMPLE.model_dump() | {"tracker": "honest"}))
    assert attach_card([repository], file) == str(repository / "external/honest.card.yaml")
    assert card_of(repository, "honest") == read(file) and card_of(repository, "reading") is None
    file.write_text(yaml.safe_dump(EXAMPLE.model_dump() | {"tracker": "onest"}))
    with pytest.raises(EvaluationError, match=r"tracker = onest: was not evaluated: use one of honest, reading\Z"):
        attach_card([repository], file)
    file.write_text(yaml.safe_dump(EXAMPLE.model_dump() | {"tracker": "dis"}))
    with pytest.raises(
        EvaluationError, match=r"tracker = dis: is in the configuration of .*: only a tracker from outs"
    ):
        attach_card([repository], file)


def test_only_sizes_at_which_a_tracker_was_scored_are_run_again(repository):
    config = repository / "config.yaml"
    config.write_text(config.read_text().replace("downsampling:\n  - 1\n", "downsampling:\n  - 1\n  - 2\n"))
    assert load(config).bmode.sizes == (64, 32)
    assert prepare_rerun(Repository(repository), "honest", "mirrored", "test").sizes == [64]
    assert prepare_rerun(Repository(repository), "dis", "mirrored", "test").sizes == [64, 32]
    with pytest.raises(EvaluationError, match=r"--size 32: honest was not evaluated at it on .*: use 64"):
        list(rerun([repository], "honest", "mirrored", "test", [32]))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"splits_seen": ["tset"]},
            "splits_seen.0 = tset: must be so: Halves .* a list of develop and test, each once",
        ),
        ({"splits_seen": "test"}, r"splits_seen = test: must be so: Halves .* a list of develop and test, each once"),
        ({"date": "2026-02-30"}, "date = 2026-02-30: must be so: Day on which it was scored, as 2026-11-23"),
        ({"date": "20261123"}, "date = 20261123: must be so: Day on which it was scored, as 2026-11-23"),
        ({"doi": "doi.org/1"}, "doi = doi.org/1: must be so: Of its publication, as 10.1000/182"),
        (
            {"name": "two\nlines"},
            "name = two lines: must be so: Name of the method, .*, in one line",
        ),
        ({"code": 5 * "long " * 60}, "code = [long ]{77}...: must be so: Address of its code"),
        ({"authors": "A"}, r"authors = A: must be so: Who made it, a list such as \[A. Author, B. Author\]"),
        (
            {"tracker": "my-net"},
            "tracker = my-net: must be so: .* letters, digits and underscores, 40 at most",
        ),
        ({"traned_on": "Kubric"}, "traned_on is not a key: did you mean trained_on?"),
    ],
)
def test_what_is_wrong_with_a_card_is_said_in_a_sentence(tmp_path, change, sentence):
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(EXAMPLE.model_dump() | change))
    with pytest.raises(ConfigError, match=f"^{file}: {sentence}"):
        read(file)


def test_card_without_a_key_is_told_what_the_key_means(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("tracker: mine")
    with pytest.raises(ConfigError) as error:
        read(file)
    assert f"{file}: trained_on is missing: it must be given: Data from which its weights" in str(error.value)
    assert len(str(error.value).splitlines()) == 7


def test_tracker_that_has_seen_test_is_shown_but_not_ranked(page, submitted):
    path = attach(submitted, Card(**EXAMPLE.model_dump() | {"tracker": "honest", "splits_seen": ["develop", "test"]}))
    try:
        again = Page(page.whole, "test")
    finally:
        path.unlink()
    assert page.order == ["dis", "honest"] and again.order == ["dis"]
    assert again.withheld["honest"] == "its card says that it has seen the half test"
    text = again.leaderboard()
    assert "\nhonest  " in page.leaderboard() and "\nhonest  " not in text and "honest" in again.everyone
    assert "\nhonest is not ranked: its card says that it has seen the half test." in text

"""What was made stands: only what is missing, damaged or of other settings is made again, with the same bytes."""

import json
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from hashlib import sha256
from itertools import product

import numpy as np
import pytest

import echotruth as et
from echotruth.cases import expand
from echotruth.config.loading import validate
from echotruth.evaluation.scoring import read_truth, score
from echotruth.repository import ledger
from echotruth.repository.rounding import CURVE
from echotruth.workflow.cost import Cost
from echotruth.workflow.job import Job
from echotruth.workflow.scripts.cases import lay_out
from echotruth.workflow.series import BEGUN, command, run_ahead, run_series

pytestmark = pytest.mark.slow

IMAGES = ("phantom", "truth", "rf", "bmode")
SMALL = {
    "name": "small",
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
    "loop": {"frames": 3},
    "motion": {"kind": "rigid"},
    "views": {"mid": {"position": 0.5}},
    "phantom": {"density_per_mm3": 100},
    "probe": {"elements": 16},
    "rf": {"lines": 24},
    "bmode": {"size_px": 128, "downsampling": [1, 2]},
    "tracking": {"grid_px": 2, "trackers": {"plain": {"window_px": 16}, "tapered": {"window_px": 16, "taper": "hann"}}},
}


def with_keys(settings, **sections):
    """The settings with some keys of some sections replaced."""
    return settings | {name: settings.get(name, {}) | keys for name, keys in sections.items()}


class Repository:
    """A repository in which stages are run as the rules do."""

    def __init__(self, folder, settings):
        self.folder = folder
        self.configure(settings)

    def configure(self, settings):
        config = validate(settings, "settings")
        lay_out(self.folder, config, expand(config))

    def series(self, *stages, view="mid", options=(), case="heart"):
        place = ["--view", view] if view else []
        arguments = command().parse_args([str(self.folder), case, *stages, *place, *options])
        run_series(arguments, Cost())
        if arguments.then:
            run_ahead(arguments, Cost())

    def record(self, stage, view="mid", case="heart"):
        return ledger.record_path(self.folder, stage, case, view)

    def forget(self, *stages, view="mid"):
        """Delete records, as Snakemake does before it runs a job again."""
        for stage in stages:
            self.record(stage, view).unlink(missing_ok=True)

    @property
    def shards(self):
        """Path in the store -> hash, of every file that holds numbers."""
        root = self.folder / "small.zarr"
        files = (path for path in root.rglob("*") if path.is_file() and "c" in path.parts)
        return {path.relative_to(root).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture
def work_done(monkeypatch):
    """Stages whose work was done since the list was last cleared."""
    from echotruth.workflow import series

    done, work_of = [], series._work

    def recording(stage):
        done.append(stage)
        return work_of(stage)

    monkeypatch.setattr(series, "_work", recording)
    return done


@pytest.fixture(scope="module")
def imaged(tmp_path_factory):
    """A heart, its images and its tracked motion."""
    made = Repository(tmp_path_factory.mktemp("imaged") / "small", SMALL)
    made.series("mechanics", "physiology", view=None)
    made.series(*IMAGES)
    made.series("tracking", "evaluation")
    return made


@pytest.fixture
def repository(imaged, tmp_path):
    """A copy of it."""
    shutil.copytree(imaged.folder, tmp_path / "small")
    copy = Repository.__new__(Repository)
    copy.folder = tmp_path / "small"
    return copy


def test_whole_view_that_lost_its_records_is_taken_up_without_any_work(repository, work_done):
    before, seconds = repository.shards, ledger.read(repository.record("rf"))["seconds"]
    repository.forget(*IMAGES)
    repository.series(*IMAGES)
    assert not work_done and repository.shards == before
    assert ledger.read(repository.record("rf"))["seconds"] == seconds


@pytest.mark.parametrize("stage, array", [("truth", "labels"), ("bmode", "image")])
def test_damaged_shard_is_healed_by_its_own_stage(repository, work_done, stage, array):
    before = repository.shards
    shard = next(name for name in before if name.startswith(f"{stage}/64/{array}/"))
    path = repository.folder / "small.zarr" / shard
    path.write_bytes(path.read_bytes()[:-1])
    repository.forget(*IMAGES)
    repository.series(*IMAGES)
    # Lines that are not kept are simulated again for the images alone.
    assert work_done == {"truth": ["truth"], "bmode": ["rf", "bmode"]}[stage]
    assert repository.shards == before


def test_changed_view_is_imaged_anew_and_changed_tracker_is_not_noticed(repository, work_done):
    repository.configure(with_keys(SMALL, tracking={"trackers": {"plain": {"window_px": 32}}}))
    repository.series(*IMAGES)
    assert not work_done
    repository.configure(with_keys(SMALL, probe={"attenuation_dB_per_cm_MHz": 0.7}))
    repository.series(*IMAGES)
    assert work_done == list(IMAGES)


def test_images_of_a_heart_that_moves_otherwise_are_made_anew(repository, work_done):
    repository.configure(with_keys(SMALL, motion={"rigid": {"rotation_deg": 3.0}}))
    repository.series("mechanics", "physiology", view=None)
    repository.series(*IMAGES)
    assert work_done == ["mechanics", "physiology", *IMAGES]


KILLED = """\
import os, signal, sys
from echotruth.workflow import job
from echotruth.workflow.scripts import bmode
bmode.work = lambda job: os.kill(os.getpid(), signal.SIGKILL)
from echotruth.workflow.cost import Cost
from echotruth.workflow.series import command, run_series
run_series(command().parse_args(), Cost())
"""


def test_kill_in_bmode_loses_no_rf(repository, imaged, tmp_path, work_done):
    arguments = (str(repository.folder), "heart", *IMAGES, "--view", "mid")
    repository.forget(*IMAGES)
    shutil.rmtree(repository.folder / "scratch")
    (tmp_path / "killed.py").write_text(KILLED)
    process = subprocess.run([sys.executable, tmp_path / "killed.py", *arguments], check=False)
    assert process.returncode == -signal.SIGKILL and repository.record("rf").exists()
    repository.forget(*IMAGES)
    repository.series(*IMAGES)
    assert work_done == ["bmode"] and repository.shards == imaged.shards


def test_new_size_is_made_from_lines_that_are_kept(tmp_path, work_done):
    kept, new = with_keys(SMALL, rf={"keep": ["lines"]}), {"downsampling": [1, 2, 4]}
    repository = Repository(tmp_path / "small", kept)
    repository.series("mechanics", view=None)
    repository.series(*IMAGES)
    work_done.clear()
    repository.configure(with_keys(kept, bmode=new))
    repository.series(*IMAGES)
    assert work_done == ["truth", "bmode"]
    fresh = Repository(tmp_path / "fresh/small", with_keys(kept, bmode=new))
    fresh.series("mechanics", view=None)
    fresh.series(*IMAGES)
    assert repository.shards == fresh.shards


def tracked(repository, monkeypatch):
    """Trackers (their taper, or their method) and sizes that are run by the rule tracking."""
    from echotruth.workflow.scripts import tracking

    calls, track = [], tracking.track

    def counting(frames, *arguments):
        settings = arguments[-1]
        calls.append((getattr(settings, "taper", settings.method), frames.shape[-1]))
        return track(frames, *arguments)

    monkeypatch.setattr(tracking, "track", counting)
    repository.series("tracking", "evaluation")
    return calls


def test_tracked_motion_that_stands_is_not_tracked_again(repository, monkeypatch):
    before = repository.shards
    repository.forget("tracking", "evaluation")
    assert tracked(repository, monkeypatch) == []
    assert repository.shards == before


TRACKERS = {
    "changed": ({"plain": {"window_px": 16}, "tapered": {"window_px": 32, "taper": "hann"}}, ["hann"]),
    "added": ({"flow": {"method": "dis"}, **SMALL["tracking"]["trackers"]}, ["dis"]),
    "reordered": (dict(reversed(SMALL["tracking"]["trackers"].items())), []),
    "removed": ({"tapered": SMALL["tracking"]["trackers"]["tapered"]}, []),
}


@pytest.mark.parametrize("change", TRACKERS)
def test_only_new_and_changed_trackers_track(repository, monkeypatch, tmp_path, change):
    trackers, expected = TRACKERS[change]
    settings = with_keys(SMALL, tracking={"trackers": trackers})
    repository.configure(settings)
    assert tracked(repository, monkeypatch) == [(method, size) for size in (128, 64) for method in expected]
    again = tmp_path / "again/small"
    shutil.copytree(repository.folder, again)
    fresh = Repository.__new__(Repository)
    fresh.folder = again
    shutil.rmtree(again / "scratch")
    fresh.series("tracking", "evaluation")
    assert repository.shards == fresh.shards


def test_only_a_new_size_is_tracked(repository, monkeypatch):
    repository.configure(with_keys(SMALL, bmode={"downsampling": [1, 2, 4]}))
    repository.series(*IMAGES)
    assert tracked(repository, monkeypatch) == [("none", 32), ("hann", 32)]


def test_view_with_a_damaged_shard_is_tracked_again(repository, monkeypatch):
    before = repository.shards
    shard = repository.folder / "small.zarr" / next(name for name in before if name.startswith("tracking/quality"))
    shard.write_bytes(b"")
    assert tracked(repository, monkeypatch) == [(taper, size) for size in (128, 64) for taper in ("none", "hann")]
    assert repository.shards == before


def test_scores_are_those_of_the_motion_that_the_store_has(repository):
    """Whoever reads the truth and the tracked motion there finds the scores, to the last bit."""
    job = Job(repository.folder, "evaluation", "heart", "mid")
    stored, tracked_motion = job.read("evaluation"), job.read("tracking", "displacement")["displacement"]
    truth = read_truth(et.Repository(repository.folder), "heart", "mid")
    inside = np.isfinite(stored["wall_axes"]).all((-2, -1))
    read = replace(
        truth,
        operator=replace(truth.operator, axes=stored["wall_axes"][inside].astype(float)),
        displacement=stored["true_displacement"][:, inside, :2].astype(float),
        through_plane=stored["true_displacement"][:, inside, 2].astype(float),
        strain=stored["true_strain"][:, :, inside].astype(float),
    )
    for size, tracker in product(range(2), range(2)):
        for name, value in score(tracked_motion[size, tracker], read).items():
            found = stored[name][size, tracker]
            np.testing.assert_array_equal(found, np.asarray(value).astype(found.dtype), err_msg=name)


def test_points_of_a_clip_are_read_with_their_strain_and_layer(repository):
    job = Job(repository.folder, "evaluation", "heart", "mid")
    read = et.Repository(repository.folder)
    found, truth = read.tracks("heart", "mid", 64, ["tapered"]).isel(tracker=0), read_truth(read, "heart", "mid")
    np.testing.assert_array_equal(found.displacement, job.read("tracking", "displacement")["displacement"][1, 1])
    np.testing.assert_array_equal(found.layer.values[truth.inside], truth.wall.layer)
    np.testing.assert_array_equal(found.segment.values[truth.inside], truth.wall.segment)
    assert not found.layer.values[~truth.inside].any()
    mean = np.nanmean(found.strain.isel(frame=truth.es).values[truth.inside], axis=0)
    expected = job.read("evaluation", "tracked_region_strain")["tracked_region_strain"][1, 1, truth.es, 1, 0]
    assert np.isfinite(expected).all()
    np.testing.assert_allclose(mean, expected, rtol=1e-5, atol=CURVE)
    with pytest.raises(ValueError, match=r"^tracker = 'other': use one of plain, tapered\.$"):
        read.tracks("heart", "mid", 64, ["other"])


def test_failure_of_a_tracker_is_tried_again(repository, monkeypatch):
    absent = {"method": "external", "track": "absent:track"}
    repository.configure(with_keys(SMALL, tracking={"trackers": {**SMALL["tracking"]["trackers"], "absent": absent}}))
    assert tracked(repository, monkeypatch) == [("external", 128), ("external", 64)]
    repository.forget("tracking", "evaluation")
    assert tracked(repository, monkeypatch)[:2] == [("external", 128), ("external", 64)]
    assert set(ledger.read(repository.record("tracking"))["failures"]) == {"absent/128", "absent/64"}


def ahead(repository):
    return repository.folder / "scratch/heart/mid/ahead-1"


def options(repository):
    return ("--then", "tracking", "evaluation", "--ahead", str(ahead(repository)))


def test_records_made_ahead_are_those_of_the_stages_themselves(repository, work_done):
    expected = {stage: ledger.read(repository.record(stage)) for stage in ("tracking", "evaluation")}
    repository.series(*IMAGES, options=options(repository))
    assert work_done == ["tracking", "evaluation"] and not (ahead(repository) / BEGUN).exists()
    for stage, record in expected.items():
        made = json.loads((ahead(repository) / f"{stage}.json").read_text())
        assert made["sha256"] == record["sha256"] and made.keys() - {"seal"} == record.keys()
        assert not repository.record(stage).exists(), "its files were written again, and its own rule has not run yet"


def test_stage_ahead_that_fails_does_not_fail_the_images_and_is_left_to_its_own_job(repository, monkeypatch, work_done):
    from echotruth.workflow.scripts import evaluation

    def fail(job):
        raise MemoryError

    monkeypatch.setattr(evaluation, "work", fail)
    repository.series(*IMAGES, options=options(repository))
    assert (ahead(repository) / BEGUN).exists()
    work_done.clear()
    repository.series(*IMAGES, options=options(repository))
    assert not work_done


def test_older_records_made_ahead_vouch_for_nothing_once_images_are_made(repository):
    older = repository.folder / "scratch/heart/mid/ahead-0"
    older.mkdir()
    (older / "evaluation.json").write_text("{}")
    repository.series(*IMAGES, options=options(repository))
    assert not older.exists()

"""Whatever happens to a repository on its way, in the end it has the bytes of one that was made at once."""

import multiprocessing
import os
import random
import shutil
import signal
import sys
from shutil import copytree

import finished_repository
import numpy as np
import pytest
from finished_repository import FINISHED, SIZE, blank, configured, content, finish, remake, solved

from echotruth.cases import expand
from echotruth.config import Bmode, Cases, Tracking
from echotruth.repository.reader import Repository

TRACKERS = FINISHED.tracking.trackers


def smaller(**changes):
    """The configuration without a heart, a view, a size or a tracker."""
    return FINISHED.model_copy(update=changes)


GROWN = {
    "cases": Cases.model_validate({"fibres.endo_deg": [60.0]}),
    "views": {"long_axis": FINISHED.views["long_axis"]},
    "bmode": Bmode(size_px=2 * SIZE, downsampling=(1,)),
    "tracking": Tracking(grid=0.016, trackers={"dis": TRACKERS["dis"]}),
}
"""What the repository has at first; the rest is then added, section by section: a tracker in front of the first one."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The repository that was made at once, of arrays that are made up."""
    return finish(tmp_path_factory.mktemp("made") / "finished", FINISHED)


@pytest.mark.slow
def test_repository_that_grew_in_any_order_is_one_that_was_made_at_once(made, tmp_path):
    left, steps = dict(GROWN), sorted(GROWN)
    random.Random(0).shuffle(steps)
    finish(tmp_path / "finished", smaller(**left))
    for section in steps:
        del left[section]
        done = remake(tmp_path / "finished", smaller(**left))
        assert len(done) > 1 and not (section != "cases" and any("mechanics" in job for job in done))
    assert content(tmp_path / "finished") == content(made)


@pytest.mark.slow
def test_scripts_make_the_bytes_of_a_repository_that_grew_those_of_one_that_was_made_at_once(finished, tmp_path):
    """A heart and a tracker are added: nothing that a script makes depends on what was made before it."""
    finish(tmp_path / "finished", smaller(cases=GROWN["cases"], tracking=GROWN["tracking"]), solved)
    remake(tmp_path / "finished", FINISHED, solved)
    assert content(tmp_path / "finished") == content(finished)


ONE = configured(views=("mid",), cases={})
JOBS = ["mechanics", "phantom", "rf", "truth", "bmode", "points", "tracking"]


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    return content(finish(tmp_path_factory.mktemp("one") / "small", ONE))


def test_run_that_is_stopped_after_each_job_is_one_that_went_on(one, tmp_path):
    """Each run makes one job, and is stopped within the next."""
    done = []

    def work(job):
        if done:
            raise KeyboardInterrupt
        done.append(job.stage)
        return blank(job)

    for stage in JOBS[:-1]:
        with pytest.raises(KeyboardInterrupt):
            remake(tmp_path / "small", ONE, work)
        assert done == [stage] and not (tmp_path / "small/SHA256SUMS").exists()
        done.clear()
    assert remake(tmp_path / "small", ONE, work) == ["tracking heart mid one", "repository"]
    assert content(tmp_path / "small") == one


WRITES = ("open", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "shutil.rmtree")
"""Events of the interpreter at which a run may be killed."""
EVENTS = 2000
"""Number of these in a run, nearly."""


def run_until(folder, last):
    """Make the repository in a process of its own group, and kill the group at an event."""
    os.setpgrp()
    seen = 0

    def count(event, arguments):
        nonlocal seen
        if event in WRITES and str(folder) in str(arguments[0]):
            seen += 1
            if seen == last:
                os.killpg(0, signal.SIGKILL)

    sys.addaudithook(count)
    finished_repository.remake(folder, ONE)


def in_process(folder, last):
    """Exit status of a run that is killed at an event."""
    server = multiprocessing.get_context("forkserver")
    server.set_forkserver_preload(["finished_repository", "echotruth.mechanics.beat"])
    process = server.Process(target=run_until, args=(folder, last))
    process.start()
    process.join()
    return process.exitcode


def test_run_that_is_killed_anywhere_is_one_that_went_on(one, tmp_path):
    folder, killed, numbers = tmp_path / "small", 0, random.Random(8)
    while killed < 4:
        if in_process(folder, numbers.randint(1, EVENTS)) == -signal.SIGKILL:
            killed += 1
        elif not numbers.randrange(2):  # it is whole: lose a job of it
            shutil.rmtree(
                folder / f"small.zarr/clips/heart/mid/{numbers.choice(['truth', 'bmode', 'points', 'tracking'])}"
            )
        else:
            shutil.rmtree(folder)
    remake(folder, ONE)
    assert content(folder) == one and not any((folder / "drafts").glob("*"))


@pytest.mark.slow
def test_changed_log_compression_makes_images_and_tracks_anew_which_are_those_of_it(finished, tmp_path):
    folder = copytree(finished, tmp_path / "finished", ignore=shutil.ignore_patterns(".lock"))
    for number, path in enumerate(folder.rglob("*")):  # a copy by other means
        os.utime(path, (1e9 + 977 * number % 10**6,) * 2)
    assert remake(folder, FINISHED, solved) == []
    changed = smaller(bmode=FINISHED.bmode.model_copy(update={"dynamic_range_dB": 35.0}))
    clips = [f"{case.id} {view}" for case in expand(FINISHED) for view in FINISHED.views]
    done = remake(folder, changed, solved)
    assert sorted(done) == sorted(
        [*(f"bmode {clip}" for clip in clips), "repository"]
        + [f"tracking {clip} {tracker}" for clip in clips for tracker in TRACKERS]
    )
    old, new = Repository(finished), Repository(folder)
    case = expand(FINISHED)[0].id
    lines = new.arrays("rf", case, "mid", "lines")["lines"]
    np.testing.assert_array_equal(lines, old.arrays("rf", case, "mid", "lines")["lines"])
    found, range_ = new.clip(case, "mid")["image"].astype(float), FINISHED.bmode.dynamic_range_dB
    was = old.clip(case, "mid")["image"].astype(float)
    grey = (was > 40) & (was < 215) & (found > 40) & (found < 215)  # the same level in dB below the white one
    np.testing.assert_allclose((255 - found).where(grey) * 35, (255 - was).where(grey) * range_, atol=2 * range_)

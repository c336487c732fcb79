"""A small benchmark with submissions: an honest one, and two that look the truth up, of which one finds it."""

import shutil
import sys
from pathlib import Path

import benchmark_repository
import pytest

from benchmarks.suite import records
from benchmarks.suite.page import Page
from benchmarks.suite.rerun import rerun
from echotruth.evaluation.run import prepare
from echotruth.repository.reader import Repository

SUBMISSIONS = '''
import sys

import numpy as np

from echotruth.config.tracking import Dis
from echotruth.repository.reader import Repository
from echotruth.tracking.tracker import track


def honest(frames, points, mask, spacing, frame_time, seed):
    return track(frames, points, mask, spacing, frame_time, seed, Dis())


def reading(frames, points, mask, spacing, frame_time, seed, repository):
    """The truth of the clip with these images in the store; if there is none, no motion."""
    opened = Repository(repository)
    for case in opened.present:
        if np.array_equal(opened.read("bmode/64/image", case, "mid"), frames):
            true = opened.read("tracking/64/true_displacement", case, "mid")[..., :2]
            return true[:, np.isfinite(true[0, ..., 0])] / spacing
    return np.zeros((len(frames), *points.shape))


def spying(frames, points, mask, spacing, frame_time, seed):
    """The truth that a function which has called this one holds; if none does, no motion."""
    caller = sys._getframe()
    while caller:
        truth = caller.f_locals.get("truth")
        if hasattr(truth, "displacement"):
            return truth.displacement / spacing
        caller = caller.f_back
    return np.zeros((len(frames), *points.shape))
'''


NAMES = ("honest", "reading")


def evaluated(folder, name, cases, **options):
    """Scores of a submission, which is evaluated on the repository and kept."""
    settings = {"method": "external", "track": f"submissions:{name}", "options": options}
    run = prepare(Repository(folder), name, settings, keep=True)
    run.check_writable()
    return run.write(list(run.rows(run.case_views(cases, []), run.sizes([]))))


@pytest.fixture(scope="session")
def submitted(tmp_path_factory):
    """Folder of the repository, in which the submissions are evaluated, kept, and run on mirrored clips."""
    place = tmp_path_factory.mktemp("benchmark")
    folder = benchmark_repository.make(place / "bench")
    (place / "submissions.py").write_text(SUBMISSIONS)
    sys.path.insert(0, str(place))
    for name in NAMES:
        options = {"repository": str(folder)} if name == "reading" else {}
        evaluated(folder, name, [] if name == "honest" else ["a_ideal", "b_ideal"], **options)
        assert len(list(rerun([folder], name, "mirrored", "test", []))) == 2
    yield folder
    sys.path.remove(str(place))


@pytest.fixture(scope="session")
def page(submitted):
    """Of the half test."""
    return Page(records.read([submitted], []), "test")


@pytest.fixture(scope="session")
def evaluate_submission():
    return evaluated


@pytest.fixture
def repository(submitted, tmp_path) -> Path:
    """A copy of it, to be changed."""
    return Path(shutil.copytree(submitted, tmp_path / "bench"))

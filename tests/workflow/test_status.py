"""`echotruth status` tells what is made, whether a run works on it, and what failed and why."""

import shutil

import pytest
from finished_repository import SIZE, blank, configured, do, jobs

from echotruth.cases import expand
from echotruth.workflow import lock
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.status import MAX_SHOWN, status_of, text

CONFIG = configured(views=("mid",), cases={"table": "case,fibres.endo_deg\na,60\nb,70\n"})


def result(job):
    """The second heart lengthens."""
    found = blank(job)
    if job.stage == "mechanics" and job.case.id == "b":
        job.notes["bounded"] = {"longitudinal_strain_max": 0.04}
    return found


def test_finished_repository_is_finished_and_names_the_hearts_that_are_not_complete(done):
    status = status_of(done)
    assert status["state"] == "finished" and status["verdicts"] == {"complete": 1, "implausible": 1}
    assert set(status["jobs"].values()) == {(2, 2)} and list(status["reasons"]) == ["b"]
    shown = text(status)
    assert "b: implausible: the mean longitudinal strain at end-systole is 0.04" in shown and "finished" in shown


def test_what_is_missing_is_counted_and_a_failed_heart_is_done(folder):
    def fail(job):
        raise CaseFailed("frame 3 has no equilibrium")

    do(next(iter(jobs(folder, expand(CONFIG)[0]))), fail)
    shutil.rmtree(folder / f"small.zarr/clips/b/mid/bmode/{SIZE}")
    status = status_of(folder)
    assert status["state"] == "stopped" and status["jobs"]["bmode"] == (1, 2) and status["jobs"]["mechanics"] == (2, 2)
    assert status["reasons"]["a"] == "failed: frame 3 has no equilibrium" and "run it to go on" in text(status)


def test_lines_and_scatterers_may_be_deleted_from_what_is_finished(folder):
    for stage in ("rf", "phantom"):
        shutil.rmtree(folder / f"small.zarr/clips/a/mid/{stage}")
    assert status_of(folder)["state"] == "finished" and status_of(folder)["jobs"]["rf"] == (1, 2)


def test_run_that_works_on_it_is_told(done, monkeypatch):
    monkeypatch.setattr(lock, "is_held", lambda folder: True)
    assert status_of(done)["state"] == "running" and "a run works on it" in text(status_of(done))


def test_without_checksums_it_is_not_finished(folder):
    (folder / "SHA256SUMS").unlink()
    assert status_of(folder)["state"] == "stopped"


def test_many_failures_are_counted(done):
    status = status_of(done) | {"reasons": {f"heart{number}": "failed: no equilibrium" for number in range(300)}}
    shown = text(status)
    assert shown.count("no equilibrium") == MAX_SHOWN and f"and {300 - MAX_SHOWN} more" in shown


@pytest.mark.parametrize("name", ["nothing", ""])
def test_other_folder_is_refused_with_a_sentence(tmp_path, name):
    with pytest.raises(FileNotFoundError, match="give the folder that a run made"):
        status_of(tmp_path / name)

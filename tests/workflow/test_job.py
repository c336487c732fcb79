"""A job: it reads its inputs, does its work, and writes its groups, or says in one sentence why not."""

import errno
import os
import subprocess
import sys

import numpy as np
import pytest
from finished_repository import SIZE, begin, blank, configured, content, do, jobs, remake

from echotruth.cases import expand
from echotruth.repository.group import read
from echotruth.workflow.failure import CaseFailed
from echotruth.workflow.job import Job, main, read_case

CONFIG = configured(views=("mid",), cases={})


def job(folder, stage):
    return next(one for one in jobs(folder, expand(CONFIG)[0]) if one.stage == stage)


def test_job_reads_what_was_written_by_those_before_it(done):
    tracking = job(done, "tracking")
    assert tracking.read(f"bmode/{SIZE}", "image")["image"].shape == (3, SIZE, SIZE)
    assert list(tracking.read("phantom")) == list(read(done / "small.zarr", "clips/heart/mid/phantom"))
    np.testing.assert_array_equal(tracking.plane.origin, tracking.read("phantom")["origin"])
    assert tracking.coordinate("rf", "range").shape == (8,)
    assert (tracking.random_of("a").random(3) == job(done, "tracking").random_of("a").random(3)).all()


def test_results_do_not_depend_on_the_order_of_the_jobs_of_a_view(done, tmp_path):
    (case,) = begin(tmp_path / "small", CONFIG)
    stages = {one.stage: one for one in jobs(tmp_path / "small", case)}
    for stage in ("mechanics", "points", "truth", "phantom", "rf", "bmode", "tracking"):
        do(stages[stage])
    assert remake(tmp_path / "small", CONFIG) == ["repository"]
    assert content(tmp_path / "small") == content(done)


@pytest.mark.parametrize("stage", ["mechanics", "phantom", "truth", "bmode", "tracking"])
def test_heart_that_fails_leaves_groups_that_say_why_in_place_of_earlier_ones(folder, stage):
    def fail(job):
        raise CaseFailed("no equilibrium at frame 3")

    one = job(folder, stage)
    do(one, fail)
    place = folder / "small.zarr" / one._place(one.groups()[0])
    assert [path.name for path in place.iterdir()] == ["zarr.json"]
    assert (
        '"failed"' in (place / "zarr.json").read_text()
        and "no equilibrium at frame 3" in (place / "zarr.json").read_text()
    )


@pytest.mark.parametrize(
    ("number", "told"), [(errno.ENOSPC, "No space left on device"), (errno.EROFS, "Read-only file")]
)
@pytest.mark.parametrize("stage", ["mechanics", "bmode"])
def test_disk_that_takes_nothing_is_told_in_one_sentence_and_the_next_run_goes_on(
    folder, monkeypatch, stage, number, told
):
    before, one = content(folder), job(folder, stage)
    (folder / "small.zarr" / one._place(one.groups()[0]) / "zarr.json").unlink()
    written = []

    def create(group, array, *_):
        written.append(array.name)
        if len(written) > 1 or stage == "bmode":
            raise OSError(number, os.strerror(number), f"out/small/{array.name}")
        return original(group, array, *_)

    from echotruth.repository import group

    original = group._create
    with monkeypatch.context() as patch:
        patch.setattr(group, "_create", create)
        with pytest.raises(
            SystemExit, match=rf"^{stage}: out/small/\w+: {told}.*: the folder must be writable"
        ) as ended:
            do(one)
    assert "\n" not in str(ended.value) and not list((folder / "drafts").glob("*"))
    assert remake(folder, CONFIG)[-1] == "repository" and content(folder) == before


@pytest.mark.parametrize(
    ("content", "sentence"),
    [(None, "heart.json: is not there: the ids are in cases.csv"), ("{", "is damaged"), ("[]", "is damaged"),
     ('{"heart": "a", "config": {"sed": 1}}', "is damaged")],
)  # fmt: skip
def test_configuration_of_a_case_that_cannot_be_read_is_told(folder, content, sentence):
    path = folder / "cases/heart.json"
    path.unlink() if content is None else path.write_text(content)
    with pytest.raises(FileNotFoundError, match=sentence):
        read_case(folder, "heart")


@pytest.mark.parametrize(
    ("stage", "arguments", "sentence"),
    [
        ("mechanics", ["nobody"], "nobody.json: is not there: the ids are in cases.csv"),
        ("rf", ["heart", "side"], "side is not a view of .*small: use mid$"),
        ("tracking", ["heart", "mid", "two"], "two is not a tracker of .*small: use one$"),
    ],
)
def test_wrong_place_is_refused_in_one_sentence(done, monkeypatch, stage, arguments, sentence):
    monkeypatch.setattr("sys.argv", [f"{stage}.py", str(done), *arguments])
    with pytest.raises(SystemExit, match=sentence) as ended:
        main(stage, blank, None)
    assert str(ended.value).startswith(f"{stage}: ") and "\n" not in str(ended.value)


def test_job_without_its_inputs_is_told_what_makes_them(tmp_path):
    (case,) = begin(tmp_path / "small", CONFIG)
    for one in jobs(tmp_path / "small", case):
        if one.stage != "mechanics":
            with pytest.raises(
                SystemExit, match=rf"^{one.stage}: .*has no group \S+: run its configuration, which makes"
            ):
                do(one, lambda one: one.heart and one.plane and one.read("phantom") and {})


def test_folder_that_is_no_repository_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.argv", ["rf.py", str(tmp_path), "heart", "mid"])
    with pytest.raises(SystemExit, match=r"^rf: .*is not a repository: give the folder that a run made"):
        main("rf", blank, None)


def test_job_writes_the_groups_of_all_sizes_or_that_of_its_tracker():
    sizes = configured(bmode={"size_px": 64, "downsampling": (1, 2)})
    found = {}
    for stage, tracker in (("truth", None), ("tracking", "dis"), ("mechanics", None), ("inference", None)):
        one = object.__new__(Job)
        one.stage, one.tracker, one.config = stage, tracker, sizes
        found[stage] = one.groups()
    assert found == {
        "truth": ["truth/64", "truth/32"],
        "tracking": ["tracking/dis"],
        "mechanics": ["heart"],
        "inference": ["inference"],
    }


LATER = """
import sys
from echotruth.workflow.job import main

assert "numba" not in sys.modules
sys.argv = ["tracking.py", "none", "heart", "mid", "bspline_dic"]
try:
    main("tracking", None, "")
except SystemExit:
    import numba
    print(numba.get_num_threads())
"""


def test_a_tracker_that_is_imported_later_has_the_threads_of_its_job(tmp_path):
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_NUM_THREADS"}
    command = [sys.executable, "-c", LATER]
    run = subprocess.run(command, cwd=tmp_path, env=environment, check=True, stdout=subprocess.PIPE, text=True)
    assert run.stdout.split() == ["1"]

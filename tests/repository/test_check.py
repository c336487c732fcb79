"""A check finds every fault of a repository, and what it says of it mends it byte for byte."""

import errno
import os
import re
import shutil

import numpy as np
import pytest
from finished_repository import SIZE, blank, configured, content, do, jobs, remake

from echotruth.cases import expand
from echotruth.repository.check import Fault, check

CONFIG = configured(views=("mid",))
FIRST, SECOND = (case.id for case in expand(CONFIG))
CLIP = f"small.zarr/clips/{FIRST}/mid"


def flip(path, random):
    """Flip one bit at a random place."""
    damaged = bytearray(path.read_bytes())
    bit = int(random.integers(8 * len(damaged)))
    damaged[bit // 8] ^= 1 << bit % 8
    path.write_bytes(damaged)


def cut(path, random):
    os.truncate(path, int(random.integers(path.stat().st_size)))


def lose(path, random):
    path.unlink()


def mend(folder, fault):
    """Do what the remedy of a fault says, but for the run."""
    found = re.fullmatch(
        r"delete (\S+?)(?:, or \S+,)?( and SHA256SUMS)? and run(?: the configuration again)?", fault.remedy
    )
    for name in [fault.path if found[1] == "it" else found[1], *(["SHA256SUMS"] if found[2] else [])]:
        path = folder / name
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def test_whole_repository_has_no_fault(done):
    report = check(done)
    assert report.faults == [] and report.notes == []
    assert report.files == len(content(done)) - 1 and report.groups == 6 + 2 * 6


def harmed(folder, harm, count, but="config.yaml"):
    """Names of files that were damaged, at random."""
    random = np.random.default_rng(count)
    names = sorted(name for name in content(folder) if name != "SHA256SUMS" and not re.search(but, name))
    chosen = {str(name) for name in random.choice(names, count, replace=False)}
    for name in sorted(chosen):
        harm(folder / name, random)
    return chosen


@pytest.mark.parametrize(("harm", "count"), [(flip, 100), (cut, 50), (lose, 50)])
def test_every_damaged_file_is_found_wherever_it_is(folder, harm, count):
    names = harmed(folder, harm, count)
    assert {fault.path for fault in check(folder, quick=True).faults} == names


@pytest.mark.parametrize("harm", [flip, lose])
def test_what_is_said_of_damaged_files_mends_them_byte_for_byte(folder, harm):
    before, names = content(folder), harmed(folder, harm, 3, but="config.yaml|/rf/|/phantom/")
    for fault in check(folder, quick=True).faults:
        assert fault.path in names
        mend(folder, fault)
    remake(folder, CONFIG)
    assert content(folder) == before and check(folder).faults == []


@pytest.mark.parametrize("stage", ["rf", "phantom"])
def test_damaged_lines_and_scatterers_leave_the_repository_and_images_stay(folder, stage):
    flip(next((folder / CLIP / stage).rglob("c/**/0")), np.random.default_rng(1))
    (fault,) = check(folder, quick=True).faults
    mend(folder, fault)
    assert remake(folder, CONFIG) == ["repository"] and check(folder).faults == []


@pytest.mark.parametrize(
    ("name", "harm"),
    [
        ("cases.csv", flip),
        ("small.zarr/zarr.json", lose),
        ("small.zarr/clips/zarr.json", flip),
        (f"{CLIP}/zarr.json", lose),
    ],
)
def test_what_no_job_wrote_is_published_again_and_no_job_is_run(folder, name, harm):
    before = content(folder)
    harm(folder / name, np.random.default_rng(2))
    (fault,) = check(folder, quick=True).faults
    assert fault.path == name
    mend(folder, fault)
    assert remake(folder, CONFIG) == ["repository"] and content(folder) == before


def test_a_lost_chunk_names_the_group_of_its_job_which_alone_is_made_again(folder):
    before, name = content(folder), f"{CLIP}/bmode/{SIZE}/image/c/0/0/0"
    (folder / name).unlink()
    fault, unreadable = check(folder).faults
    remedy = f"delete {CLIP}/bmode/{SIZE} and run the configuration again"
    assert fault == Fault(name, "is missing", remedy)
    assert str(fault) == f"{name} is missing: {remedy}"
    assert (unreadable.path, unreadable.remedy) == (f"{CLIP}/bmode/{SIZE}", remedy)
    mend(folder, fault)
    assert remake(folder, CONFIG) == [f"bmode {FIRST} mid", "repository"] and content(folder) == before


def test_exchanged_files_are_found(folder):
    names = [f"{CLIP}/rf/lines/zarr.json", f"{CLIP}/truth/{SIZE}/labels/zarr.json"]
    contents = [(folder / name).read_bytes() for name in names]
    for name, other in zip(names, reversed(contents), strict=True):
        (folder / name).write_bytes(other)
    found = {fault.path for fault in check(folder).faults}
    assert found == {*names, f"{CLIP}/rf", f"{CLIP}/truth/{SIZE}"}


def test_hearts_that_changed_places_are_found(folder):
    clips = folder / "small.zarr/clips"
    for source, target in ((FIRST, "aside"), (SECOND, FIRST), ("aside", SECOND)):
        (clips / source).rename(clips / target)
    faults = check(folder, quick=True).faults
    assert {f"{CLIP}/bmode/{SIZE}", f"{CLIP}/zarr.json"} <= {fault.path for fault in faults}


@pytest.mark.parametrize("name", ["small.zarr/stray", f"{CLIP}/rf/lines/c/7"])
def test_file_that_nobody_wrote_is_found_and_deleted(folder, name):
    before = content(folder)
    (folder / name).write_bytes(b"half")
    (fault,) = check(folder, quick=True).faults
    assert (fault.path, fault.problem) == (name, "is not listed in SHA256SUMS")
    mend(folder, fault)
    assert content(folder) == before and check(folder).faults == []


@pytest.mark.parametrize("harm", [os.mkfifo, lambda path: path.symlink_to("/dev/zero"), os.mkdir])
def test_what_is_no_file_is_missing_and_is_not_read(folder, harm):
    path = folder / f"{CLIP}/rf/lines/zarr.json"
    path.unlink()
    harm(path)
    assert path.relative_to(folder).as_posix() in {fault.path for fault in check(folder, quick=True).faults}


def test_impossible_value_is_found_although_its_checksum_is_right(folder):
    def wrong(job):
        found = blank(job)
        found["truth/64"]["displacement"][0, 8, 9] = 1e-4
        return found

    do(next(job for job in jobs(folder, expand(CONFIG)[0]) if job.stage == "truth"), wrong)
    (folder / "SHA256SUMS").unlink()
    remake(folder, CONFIG)
    (fault,) = check(folder).faults
    assert fault.path == f"{CLIP}/truth/64/displacement" and "is not 0 at end-diastole" in fault.problem
    assert "report it with the configuration" in fault.remedy


def test_what_is_not_made_yet_is_told_and_is_no_damage(folder):
    shutil.rmtree(folder / CLIP / "tracking")
    (folder / "SHA256SUMS").unlink()
    report = check(folder)
    assert report.faults == [] and "the run has not ended" in report.notes[0]


def test_folder_that_is_no_repository_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(FileNotFoundError, match="is not a repository"):
        check(tmp_path)
    assert not list(tmp_path.iterdir())


def test_file_that_cannot_be_read_is_an_error_with_its_name(folder, monkeypatch):
    def fail(path):
        raise OSError(errno.EIO, "Input/output error", str(path))

    monkeypatch.setattr("echotruth.repository.check.checksum", fail)
    with pytest.raises(OSError, match=r"Input/output error: '.*small"):
        check(folder)

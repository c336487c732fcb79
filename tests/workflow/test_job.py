"""Files that the stages of a view pass on."""

import errno
import os
from zipfile import ZipFile

import numpy as np
import pytest
from finished_repository import configured

from echotruth.cases import expand
from echotruth.repository.case_file import read_case
from echotruth.repository.layout import lay_out
from echotruth.workflow.job import Job, run

PASSED = {"lines": np.arange(6.0).reshape(2, 3), "range": np.arange(3)}


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    config, folder = configured(seeds=[1]), tmp_path_factory.mktemp("passed") / "small"
    lay_out(folder, config, expand(config))
    return Job(folder, "bmode", expand(config)[0].id, "mid", 64, code="1")


def test_arrays_come_back_as_they_were_passed_on(job):
    job.pass_on(job.lines, PASSED)
    found = job.passed_on(job.lines)
    assert list(found) == list(PASSED)
    for name, values in PASSED.items():
        np.testing.assert_array_equal(found[name], values)


def damages(content):
    """A file cut short, and one with a flipped bit in every byte of the values of its first array."""
    yield content[: len(content) // 2]
    first = content.index(PASSED["lines"].tobytes())
    for place in range(first, first + PASSED["lines"].nbytes):
        yield content[:place] + bytes([content[place] ^ 4]) + content[place + 1 :]


def test_damaged_file_is_deleted_with_a_sentence(job):
    job.pass_on(job.lines, PASSED)
    for damaged in [*damages(job.lines.read_bytes()), b"", b"no archive"]:
        job.lines.write_bytes(damaged)
        with pytest.raises(
            FileNotFoundError, match=r"lines\.npz: is not what was written: it is deleted, and the next"
        ):
            job.passed_on(job.lines)
        assert not job.lines.exists()


def test_bytes_in_place_of_an_array_are_not_passed_on(job):
    """NumPy gives what is no array in an archive as it stands there."""
    job.lines.parent.mkdir(parents=True, exist_ok=True)
    with ZipFile(job.lines, "w") as archive:
        archive.writestr("lines.npy", b"no array")
    with pytest.raises(FileNotFoundError, match="is not what was written"):
        job.passed_on(job.lines)


def test_pipe_in_place_of_the_configuration_of_a_case_is_not_waited_for(tmp_path):
    (tmp_path / "cases").mkdir()
    os.mkfifo(tmp_path / "cases/heart.json")
    with pytest.raises(FileNotFoundError, match=r"heart\.json: is not a file: the ids are in cases\.csv"):
        read_case(tmp_path, "heart")


def test_objects_are_not_unpickled(job):
    """A pickle that is planted in the folder runs nothing."""

    class Planted:
        def __reduce__(self):
            return job.lines.with_name("planted").mkdir, ()

    np.savez(job.lines, lines=np.array([Planted()], dtype=object))
    with pytest.raises(FileNotFoundError, match="is not what was written"):
        job.passed_on(job.lines)
    assert not job.lines.with_name("planted").exists()


def test_disk_that_is_full_is_told_with_the_file(job):
    def work(job):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "out/small/image")

    with pytest.raises(SystemExit, match="bmode: out/small/image: No space left on device: the folder must be"):
        run(job, work)

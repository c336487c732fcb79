"""`echotruth info`: what it tells is what is there."""

import platform
import shutil
from importlib.metadata import version

import finished_repository
import known_repository
import numpy as np
import pytest

import echotruth


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("info") / "small"
    finished_repository.finish(folder, finished_repository.configured(seeds=(1, 2), views=("mid",)))
    return folder


def test_installation_is_told(call):
    status, output, errors = call("info")
    assert (status, errors) == (0, "")
    ours, python, others = output.splitlines()
    assert ours.startswith(f"echotruth {echotruth.__version__}, ")
    assert python.startswith(f"Python {platform.python_version()} on ")
    assert f"numpy {version('numpy')}" in others


def test_repository_is_told(call, finished):
    status, output, errors = call("info", finished)
    assert (status, errors) == (0, "")
    assert output.startswith(str(echotruth.Repository(finished))) and "2 complete" in output


def test_repository_opens_as_it_is_told(call, known):
    code = "\n".join(line.strip() for line in call("info", known.folder)[1].partition("Open it:\n")[2].splitlines())
    found: dict = {}
    exec(code, found)
    assert len(found["repository"].cases) == 1
    np.testing.assert_array_equal(found["clip"]["image"].values, known.images(known_repository.SIZES[0]))


def test_repository_that_no_run_has_finished_is_told_so(call, tmp_path):
    finished_repository.begin(tmp_path / "small", finished_repository.configured(seeds=(1, 2, 3)))
    status, output, _ = call("info", "small")
    assert status == 0 and "3 unfinished" in output
    assert 'repository = et.Repository("small")' in output and "clip" not in output


@pytest.mark.parametrize(
    ("place", "sentence"),
    [
        ("nowhere", "nowhere: is not a repository: give the folder that a run made, such as out/demo"),
        ("s3://bucket/demo", "s3://bucket/demo: is an address and not a folder"),
    ],
)
def test_what_is_no_repository_is_refused_in_one_line(call, place, sentence):
    status, output, errors = call("info", place)
    assert (status, output, errors.count("\n")) == (2, "", 1) and sentence in errors


@pytest.mark.parametrize("name", ["config.yaml", "cases.csv"])
def test_damaged_repository_is_refused_in_one_line(call, finished, tmp_path, name):
    shutil.copytree(finished, tmp_path / "small")
    (tmp_path / "small" / name).write_text("{")
    status, output, errors = call("info", "small")
    assert (status, output, errors.count("\n")) == (2, "", 1) and name in errors, errors

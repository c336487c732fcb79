"""Described repositories, made once."""

from pathlib import Path
from shutil import copytree

import pytest
from described_repository import given, make_finished, make_unfinished

from echotruth.repository.description import describe


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """A finished repository; tests copy it before they change anything but its documents."""
    return make_finished(tmp_path_factory.mktemp("finished") / "small")


@pytest.fixture(scope="session")
def described(finished, tmp_path_factory) -> Path:
    """The finished repository with its documents."""
    folder = copytree(finished, tmp_path_factory.mktemp("described") / "small")
    describe(folder, None, given())
    return folder


@pytest.fixture(scope="session")
def unfinished(tmp_path_factory) -> Path:
    """A repository that failed and stopped half-way, with its documents."""
    return make_unfinished(tmp_path_factory.mktemp("unfinished") / "small")

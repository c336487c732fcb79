"""Described repositories, made once."""

from pathlib import Path
from shutil import copytree

import pytest
from described_repository import GIVEN, make_failed, make_finished

from echotruth.repository.reader import Repository
from echotruth.sharing.description import describe


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """A finished repository; tests copy it before they change anything but its documents."""
    return make_finished(tmp_path_factory.mktemp("finished") / "small")


@pytest.fixture(scope="session")
def described(finished, tmp_path_factory) -> Path:
    """The finished repository with its documents."""
    folder = copytree(finished, tmp_path_factory.mktemp("described") / "small")
    describe(Repository(folder), None, GIVEN)
    return folder


@pytest.fixture(scope="session")
def failed(tmp_path_factory) -> Path:
    """A repository of which one heart failed, with its documents and nobody's name or licence."""
    folder = make_failed(tmp_path_factory.mktemp("failed") / "small")
    describe(Repository(folder))
    return folder

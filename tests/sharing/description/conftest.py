"""Described repositories, made once."""

from pathlib import Path
from shutil import copytree

import pytest
from described_repository import GIVEN, make_failed, make_finished
from once import once

from echotruth.repository.reader import Repository
from echotruth.sharing.description import describe


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """A finished repository; tests copy it before they change anything but its documents."""
    return once(tmp_path_factory, "to_describe", lambda to: make_finished(to / "small")) / "small"


@pytest.fixture(scope="session")
def described(finished, tmp_path_factory) -> Path:
    """The finished repository with its documents."""
    folder = copytree(finished, tmp_path_factory.mktemp("described") / "small")
    describe(Repository(folder), None, GIVEN)
    return folder


@pytest.fixture(scope="session")
def failed(tmp_path_factory) -> Path:
    """A repository of which one heart failed, with its documents and nobody's name or licence."""
    return once(tmp_path_factory, "failed", lambda to: describe(Repository(make_failed(to / "small")))) / "small"

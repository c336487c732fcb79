"""Released repositories, made once."""

from pathlib import Path

import pytest
from once import once
from released_repository import GIVEN, make_failed, make_finished

from echotruth.repository.reader import Repository
from echotruth.sharing.release import release


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    """A finished repository; tests copy it before they change anything."""
    return once(tmp_path_factory, "to_release", lambda to: make_finished(to / "small")) / "small"


@pytest.fixture(scope="session")
def files(finished, tmp_path_factory) -> Path:
    """Its release."""
    folder = tmp_path_factory.mktemp("release") / "small-release"
    release(Repository(finished), folder, GIVEN)
    return folder


@pytest.fixture(scope="session")
def failed(tmp_path_factory) -> Path:
    """The release of a repository of which one heart failed, with nobody's name or licence."""

    def make(to):
        release(Repository(make_failed(to / "small")), to / "files")

    return once(tmp_path_factory, "failed", make) / "files"

"""The repository that the tests of this folder read."""

import pytest
from learning_repository import made


@pytest.fixture(scope="session")
def repository(tmp_path_factory):
    return made(tmp_path_factory.mktemp("learning") / "small")

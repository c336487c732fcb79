"""The repository that the tests of this folder read."""

import pytest


@pytest.fixture(scope="session")
def repository(textured):
    return textured

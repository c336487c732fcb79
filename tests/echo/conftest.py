"""A contracting ring, and the repository that exports are read from."""

import pytest
from contracting_ring import Ring
from known_repository import SETTINGS, Known, make


@pytest.fixture(scope="session")
def ring():
    return Ring()


@pytest.fixture(scope="session")
def known(tmp_path_factory) -> Known:
    return make(tmp_path_factory.mktemp("known") / "known", SETTINGS)

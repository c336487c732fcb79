"""A contracting ring."""

import pytest
from contracting_ring import Ring


@pytest.fixture(scope="session")
def ring():
    return Ring()

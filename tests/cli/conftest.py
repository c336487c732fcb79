"""The command line, in an empty folder."""

from functools import partial

import pytest
from cli.command_line import run_cli


@pytest.fixture
def call(tmp_path):
    """Run a command in an empty folder; its status, output and errors."""
    return partial(run_cli, cwd=tmp_path)

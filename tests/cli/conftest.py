"""The command line, run in this process."""

import io
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from unittest.mock import patch

import pytest

from echotruth.cli import main


@pytest.fixture
def call(tmp_path):
    """Run a command in an empty folder; its status, output and errors."""

    def run(*arguments):
        output, errors, status = io.StringIO(), io.StringIO(), 0
        with chdir(tmp_path), redirect_stdout(output), redirect_stderr(errors):
            try:
                with patch("sys.argv", ["echotruth", *map(str, arguments)]):
                    main()
            except SystemExit as ended:
                status = ended.code
                if isinstance(status, str):  # as the interpreter does it
                    print(status, file=sys.stderr)
                    status = 1
        return status or 0, output.getvalue(), errors.getvalue()

    return run

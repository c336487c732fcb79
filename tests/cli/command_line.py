"""The command line, run in this process."""

import io
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

from echotruth.cli import main

ROOT = Path(__file__).parents[2]


def run_cli(*arguments, cwd=ROOT):
    """Status, output and errors of the command, run in this process."""
    output, errors, status = io.StringIO(), io.StringIO(), 0
    with chdir(cwd), redirect_stdout(output), redirect_stderr(errors):
        try:
            with patch("sys.argv", ["echotruth", *map(str, arguments)]):
                main()
        except SystemExit as exit_:
            status = exit_.code
            if isinstance(status, str):  # as the interpreter does it
                print(status, file=sys.stderr)
                status = 1
    return status or 0, output.getvalue(), errors.getvalue()

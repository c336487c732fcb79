"""A command that serves a page, while a test opens it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def served_page(*arguments: str) -> Iterator[str]:
    """Address that `echotruth` prints for a page; when it is left, the command ends well."""
    command = [sys.executable, "-m", "echotruth", *arguments, "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().split()[1]
        finally:
            process.terminate()
    assert process.returncode == 0

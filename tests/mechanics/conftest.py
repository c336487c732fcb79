"""Files of meshes that are read in the process of the tests."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

from echotruth.mechanics.geometry import vtk_process


@pytest.fixture
def read_here(monkeypatch):
    """VTK reads in this process, not in one of its own, which takes longer than all else that a test does."""

    def run(command, **streams):
        for number, source in enumerate(streams["input"].split("\n")):
            vtk_process._copy(source, Path(command[-1]) / f"{number}.vtu")

    monkeypatch.setattr(vtk_process, "subprocess", SimpleNamespace(run=run, TimeoutExpired=subprocess.TimeoutExpired))

"""The notebooks: every cell runs, and every cell that draws draws."""

import json
import shlex
import shutil
from pathlib import Path

import learning_repository
import matplotlib.pyplot as plt
import pytest
from cli.command_line import run_cli
from finished_repository import do, solved

import echotruth as et
from benchmarks.suite import power
from echotruth.cli import parser
from echotruth.workflow.added_tracker import AddedTracker
from echotruth.workflow.job import Job

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted(ROOT.glob("docs/notebooks/*.ipynb"))
CONFIGURE, INFER = et.configure, et.infer


def cells(notebook):
    found = json.loads(notebook.read_text())["cells"]
    return ["".join(cell["source"]) for cell in found if cell["cell_type"] == "code"]


def coarser(seen, **options):
    """Infer a heart on fewer elements, whose stiffness and fibres are known."""
    known = dict.fromkeys(("mechanics.regional.stiffness", "fibres.endo_deg", "fibres.epi_deg"))
    return INFER(seen, known, **options | {"mesh": (6, 4, 1)})


def track_here(added, case_view):
    do(Job(added.repository.folder, "tracking", *case_view, added.name), solved)


def command(line):
    """Run a command of a notebook in this process; its jobs too."""
    _, name, *arguments = shlex.split(line)
    if name == "run":
        parser().parse_known_args([name, *arguments])
        learning_repository.make(Path("out/first"), CONFIGURE(et.configure(arguments[0]), loop={"frames": 6}))
    else:
        assert run_cli(name, *arguments, cwd=Path.cwd())[0] == 0


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs_and_every_cell_that_draws_draws(notebook, coarse, tmp_path, monkeypatch):
    folder = tmp_path / "docs/notebooks"
    shutil.copytree(notebook.parent, folder, ignore=shutil.ignore_patterns("out", ".*", "__pycache__"))
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(et, "infer", coarser)
    monkeypatch.setattr(power, "SAMPLES", 100)
    monkeypatch.setattr(AddedTracker, "_run", track_here)
    plt.close("all")
    names: dict[str, object] = {}
    for source in cells(notebook):
        if source.startswith("!"):
            command(source[1:])
            continue
        exec(source, names)
        assert len(plt.get_fignums()) == source.count("plt.subplots")
        for number in plt.get_fignums():
            plt.figure(number).canvas.draw()
        plt.close("all")

"""The pages: their commands are known, what those of the first hour show runs, their configurations are valid."""

import json
import re
import shlex
from importlib.util import find_spec
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
import yaml
from cli.command_line import run_cli

import echotruth as et
from echotruth.cli import parser
from echotruth.config.cases import HEARTS
from echotruth.loop.cycle import read_loop

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("docs/start/*.md")])
NOTEBOOKS = sorted(ROOT.glob("docs/notebooks/*.ipynb"))
COMMAND = re.compile(r"^(?:    )*(?:\.venv/bin/)?echotruth (?P<rest>(?:[^\n\\]|\\\n|\\.)*)", re.MULTILINE)
COMMAND_HELP = re.compile(r"^(?:--version|COMMAND|of |is |will |runs )")
"""How lines go on that begin with the word echotruth and are no command."""


def commands(text):
    """Arguments of the command lines in a page."""
    for found in COMMAND.finditer(text):
        rest = found["rest"].replace("\\\n", " ")
        inside = text[: found.start()].count("```") % 2 or found.group().startswith(("    ", ".venv"))
        if inside and not COMMAND_HELP.match(rest):
            yield shlex.split(rest, comments=True)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_on_a_page_are_those_of_the_command_line(page):
    for arguments in commands(page.read_text()):
        try:
            known, others = parser().parse_known_args(arguments)
        except SystemExit:
            pytest.fail(f"echotruth {shlex.join(arguments)}")
        assert known.command == "run" or not others, arguments  # run hands other options to Snakemake


def test_commands_are_found_on_the_pages():
    found = [arguments for page in PAGES for arguments in commands(page.read_text())]
    assert len(found) > 30
    assert {"run", "check", "evaluate", "export"} <= {arguments[0] for arguments in found}


FIRST_PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/start/*.md"))]


@pytest.mark.slow
@pytest.mark.parametrize("page", FIRST_PAGES, ids=lambda page: page.stem)
def test_python_of_the_first_hour_runs_as_it_stands_in_a_folder_with_a_space(page, demo, coarse, monkeypatch):
    """Hearts are coarser, and `out/infarcts` is the sample."""
    (demo / "out/infarcts").unlink(missing_ok=True)
    (demo / "out/infarcts").symlink_to(et.sample().folder)
    monkeypatch.chdir(demo)
    monkeypatch.setattr(plt, "show", plt.close)
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL):
        if "echotruth.torch" not in block or find_spec("torch"):
            exec(block, names)
    assert names or page.stem in ("install", "cluster")


@pytest.mark.parametrize("page", FIRST_PAGES, ids=lambda page: page.stem)
def test_commands_of_the_first_hour_that_read_a_configuration_run_as_they_stand(page, tmp_path):
    for arguments in commands(page.read_text()):
        is_cheap = arguments[0] in ("new", "check", "cases") or "--estimate" in arguments
        if is_cheap and not any(word.startswith(("out/", "config/")) for word in arguments):
            status, _, errors = run_cli(*arguments, cwd=tmp_path)
            assert status == 0, (arguments, errors)


@pytest.mark.parametrize("name", ["own_heart", "own_array"])
def test_configurations_on_a_page_are_valid(name):
    blocks = re.findall(r"```yaml\n(.*?)```", (ROOT / f"docs/{name}.md").read_text(), re.DOTALL)
    assert len(blocks) >= 3
    for block in blocks:
        keys = yaml.safe_load(block)
        if "file" in keys.get("loop", {}):
            keys["loop"]["file"] = "mouse"
        et.configure(keys)


def test_hearts_can_be_drawn_as_the_page_on_realistic_images_says():
    (block,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/realism.md").read_text(), re.DOTALL)
    cases = et.expand(et.configure(yaml.safe_load(block)))
    assert len(cases) == 64
    assert len({case.config.bmode.gain_dB for case in cases}) == 64


@pytest.mark.parametrize("species", ["mouse", "rat", "human"])
def test_hearts_of_any_species_can_be_drawn_as_the_page_on_cases_says(species):
    page = (ROOT / "docs/cases.md").read_text()
    (block,) = (block for block in re.findall(r"```yaml\n(.*?)```", page, re.DOTALL) if "preset: hearts" in block)
    cases = et.expand(et.configure(yaml.safe_load(block.replace("rat", species))))
    assert len({case.heart for case in cases}) == 64
    ranges = {key: given["uniform"] for key, given in HEARTS.items() if "uniform" in given}
    assert {f"{low:g} to {high:g}" for low, high in ranges.values()} <= set(re.findall(r"-?[\d.]+ to -?[\d.]+", page))
    for case in cases:
        assert all(low <= case.parameters[key] <= high for key, (low, high) in ranges.items())


def test_table_of_a_loop_on_the_page_is_one_that_is_read(tmp_path):
    (block,) = re.findall(r"```text\n(time_ms.*?)```", (ROOT / "docs/own_heart.md").read_text(), re.DOTALL)
    rest = "".join(
        f"{time}.0,{pressure}.0,{volume}.0\n" for time, pressure, volume in ((30, 90, 40), (60, 80, 20), (90, 5, 35))
    )
    (tmp_path / "my_loop.csv").write_text(block + rest + "120.0,6.0,50.0\n")
    config = et.configure(loop={"file": str(tmp_path / "my_loop.csv"), "frames": 8})
    assert read_loop(config.loop).volume.max() == pytest.approx(50e-9, rel=1e-6)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_outputs(notebook):
    cells = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
    assert cells
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)


def test_hearts_of_the_notebooks_are_four_in_groups_that_a_split_can_part(monkeypatch):
    monkeypatch.chdir(ROOT / "docs/notebooks")
    cases = et.expand(et.configure("first.yaml"))
    assert [case.id for case in cases] == ["healthy_1", "healthy_2", "infarct_1", "infarct_2"]

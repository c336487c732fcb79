"""What README.md shows runs, and what it names exists."""

import re
import shutil
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import yaml

from echotruth.cases import expand
from echotruth.cli import parser
from echotruth.config.loading import load
from echotruth.loop.cycle import SHIPPED

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
PYTHON, YAML = (re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL) for language in ("python", "yaml"))


def test_five_lines_open_a_repository_and_show_motion_upright(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(plt, "show", lambda: None)
    lines = PYTHON[0]
    assert len(lines.split("\n\n")[-1].splitlines()) + lines.count("import ") == 5
    names = {}
    exec(lines, names)
    bottom, top = plt.gca().get_ylim()
    plt.close("all")
    assert bottom > top, "depth points down"
    assert names["clip"]["displacement"].dims == ("frame", "axial", "lateral", "vector")


def test_configurations_are_valid(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(SHIPPED / "human.csv", "my_loop.csv")
    for text in YAML:
        (tmp_path / "mine.yaml").write_text(text)
        config = load("mine.yaml")
        assert yaml.safe_load(text).keys() <= config.model_fields_set
    assert len(YAML) == 2


def test_files_and_commands_exist():
    named = re.findall(r"\]\(([\w/.]+)\)|`((?:config|docs|examples)/[\w/.]+)`", README)
    paths = {first or second for first, second in named}
    assert len(paths) > 20
    assert [path for path in paths if not (ROOT / path).exists()] == []
    modules = {name for name in re.findall(r"`([\w/]+(?:/|\.py))`", README) if not name.startswith(("src", "out"))}
    assert [name for name in modules if not (ROOT / "src/echotruth" / name).exists()] == []
    commands = set(re.findall(r"^    echotruth (\w+)", README, re.MULTILINE))
    known = next(action.choices for action in parser()._actions if action.dest == "command")
    assert commands and commands <= set(known)


def test_repository_of_the_defaults_has_the_sizes_that_are_named():
    config = expand(load(ROOT / "config/demo.yaml"))[0].config
    assert [config.bmode.size_px // factor for factor in config.bmode.downsampling] == [512, 256, 128]
    assert config.probe.elements == 64 and np.allclose(config.bmode.field_of_view_mm, 12)

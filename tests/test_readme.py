"""What README.md names exists."""

import re
import shutil
from pathlib import Path

import numpy as np
import yaml

from echotruth.cases import expand
from echotruth.config.loading import load
from echotruth.loop.cycle import SHIPPED

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
YAML = re.findall(r"```yaml\n(.*?)```", README, re.DOTALL)


def test_configurations_are_valid(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(SHIPPED / "human.csv", "my_loop.csv")
    for text in YAML:
        (tmp_path / "mine.yaml").write_text(text)
        config = load("mine.yaml")
        assert yaml.safe_load(text).keys() <= config.model_fields_set
    assert len(YAML) == 2


def test_files_exist():
    named = re.findall(r"\]\(([\w/.]+)\)|`((?:config|docs|examples)/[\w/.]+)`", README)
    paths = {first or second for first, second in named}
    assert len(paths) > 20
    assert [path for path in paths if not (ROOT / path).exists()] == []
    modules = {name for name in re.findall(r"`([\w/]+(?:/|\.py))`", README) if not name.startswith(("src", "out"))}
    assert [name for name in modules if not (ROOT / "src/echotruth" / name).exists()] == []


def test_repository_of_the_defaults_has_the_sizes_that_are_named():
    config = expand(load(ROOT / "config/demo.yaml"))[0].config
    assert [config.bmode.size_px // factor for factor in config.bmode.downsampling] == [512, 256, 128]
    assert config.probe.elements == 64 and np.allclose(config.bmode.field_of_view_mm, 12)

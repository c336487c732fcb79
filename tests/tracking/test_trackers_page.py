"""The examples of docs/trackers.md run."""

import inspect
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import yaml

from echotruth.config import Config
from echotruth.config.loading import checked, validate
from echotruth.config.tracking import ENTRY_POINT_GROUP, TRACKER_ARGUMENTS, External, OnnxSignature
from echotruth.tracking import track

PAGE = (Path(__file__).parents[2] / "docs/trackers.md").read_text()
TRACKER, PROGRAM, FLOW = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
(PACKAGE,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
CONFIGURATION, DECLARATION = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
SHIFT = np.array([1.3, -0.6])
"""Motion of the speckle from frame to frame: lateral, axial, px."""


@pytest.fixture
def speckle(clip, tmp_path, monkeypatch):
    """Arguments of a tracker for speckle that moves by SHIFT; the code of the page is in the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path[:])
    monkeypatch.delitem(sys.modules, "mypackage", raising=False)
    Path("mypackage.py").write_text(TRACKER)
    Path("network.py").write_text(PROGRAM)
    frames, along = clip(lambda place, t: place + t * SHIFT, 5), np.arange(40, 121, 12.5)
    points = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    return frames, points, np.ones(frames.shape[1:], bool), 2.3e-5, np.arange(5) * 1e-3, 1


def test_tracker_of_the_page_follows_shifted_speckle_to_a_tenth_of_a_pixel(speckle):
    displacement, quality = track(*speckle, External(track="mypackage:track", options={"window_mm": 0.5}))
    error = displacement - np.multiply.outer(np.arange(5), SHIFT)[:, None]
    assert np.linalg.norm(error, axis=-1).max() < 0.1
    assert np.isnan(quality).all()


def test_dense_flow_of_the_page_follows_shifted_speckle_to_a_tenth_of_a_pixel(speckle):
    Path("mypackage.py").write_text(FLOW)
    displacement, _ = track(*speckle, External(track="mypackage:track"))
    error = displacement[-1] - 4 * SHIFT
    assert np.linalg.norm(error.mean(axis=0)) < 0.1


def test_program_of_the_page_runs(speckle):
    displacement, _ = track(*speckle, External(command=[sys.executable, "network.py", "{input}", "{output}"]))
    assert displacement.shape == (5, len(speckle[1]), 2) and not displacement.any()


def test_tables_of_the_page_are_in_the_order_of_the_arguments_and_of_the_keys():
    rows = re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)
    assert tuple(rows) == (*TRACKER_ARGUMENTS, "displacement", "quality", *OnnxSignature.model_fields)
    scope = {}
    exec(TRACKER, scope)
    assert tuple(inspect.signature(scope["track"]).parameters) == (*TRACKER_ARGUMENTS, "window_mm")


def test_configuration_and_entry_point_of_the_page_are_valid():
    config = validate(yaml.safe_load(CONFIGURATION), "docs/trackers.md")
    assert isinstance(config, Config) and isinstance(config.tracking.trackers["network"], External)
    assert config.tracking.trackers["learned"].model == "model.onnx"
    assert list(tomllib.loads(PACKAGE)["project"]["entry-points"]) == [ENTRY_POINT_GROUP]


def test_declaration_of_the_page_is_the_example_and_valid():
    assert (Path(__file__).parents[2] / "examples/myotracker.yaml").read_text() == DECLARATION
    assert checked(yaml.safe_load(DECLARATION), "myotracker.yaml", OnnxSignature).coordinates == "row_column"

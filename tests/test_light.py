"""What echotruth does without the extra `make`: it reads, loads and scores, and says what the rest needs.

The packages of the extra are absent for a process in which their names stand for no module.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement

import echotruth as et
from echotruth.extras import MAKE, installation

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

LIGHT = f"""
import sys
for name in {(*MAKE, "onnxruntime")!r}:
    sys.modules[name] = None
"""

READ = """
import numpy as np
import echotruth as et

hearts = et.sample()
clip, heart = hearts.clip("infarct", "mid"), hearts.heart("infarct")

def at_rest(frames, points, mask, spacing, frame_time, seed):
    return np.zeros((len(frames), len(points), 2))

scores = et.evaluate(et.track(clip, at_rest), heart)
assert abs(scores["nrmse_percent"] - 100) < 1e-6, scores  # nothing found: all of the motion is an error
stored = hearts.curves("infarct", "mid", "bspline_dic")
assert float(abs(stored["true_line_strain"]).max()) > 0.05
assert float(abs(et.kinematics(heart)["strain"]).max()) > 0.05
chosen = et.learning.cases("sample")
paths = et.learning.PointTracks("sample", chosen, points=8)[0]["position"]
assert paths.shape == (10, 8, 2) and np.isfinite(paths).all()
assert np.isfinite(et.learning.FlowPairs("sample", chosen)[0]["flow"]).any()
"""

FIRST = """
import shlex
from echotruth.cli import main
for command in {!r}:
    sys.argv = shlex.split(command, comments=True)
    main()
"""

WHOLE = f"needs the package {{}}: {installation('make')}"
NEEDED = {
    "show sample --no-browser": "bokeh",
    "run demo --dry-run": "snakemake",
    "track clip.npz --wall wall.csv --view mid --spacing-mm 1 --frame-time-ms 1": "matplotlib",
    "export sample --format mp4 -o mp4": "imageio_ffmpeg",
    "evaluate copy --tracker dis --name mine --case healthy --view mid": "cv2",
    "evaluate copy --onnx a.onnx": "onnxruntime",
}
"""Command to the first package that it lacks."""

COMMANDS = f"""
from echotruth.cli import main
for command in {[*NEEDED]!r}:
    sys.argv = ["echotruth", *command.split()]
    try:
        main()
    except SystemExit as end:
        assert end.code == 2, (command, end.code)
"""


def light(program: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A program in a folder and a process without the packages of the extra."""
    command = [sys.executable, "-W", "error::RuntimeWarning", "-c", LIGHT + program]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_light_installation_reads_loads_and_scores(tmp_path):
    done = light(READ, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", ["README.md", "docs/start/install.md"])
def test_commands_that_follow_the_light_installation_run(tmp_path, page):
    text = (ROOT / page).read_text().partition("pip install . ")[2].partition("pip install '.[make]'")[0]
    commands = re.findall(r"^ *(echotruth .*)", text, re.MULTILINE)
    folder = tmp_path / "first hour"
    folder.mkdir()
    done = light(FIRST.format(commands), folder)
    assert commands and done.returncode == 0, done.stderr
    assert len([*folder.glob("clips/*.gif")]) == 4


def test_command_that_needs_more_says_which_extra_in_one_line(tmp_path):
    shutil.copytree(et.sample().folder, tmp_path / "copy")
    (tmp_path / "wall.csv").touch()
    (tmp_path / "a.onnx").touch()
    np.savez(tmp_path / "clip.npz", image=np.zeros((4, 8, 8)))
    done = light(COMMANDS, tmp_path)
    said = [f"echotruth: {command.split()[0]} {WHOLE.format(package)}" for command, package in NEEDED.items()]
    said[-2] = f"echotruth: the tracker dis {WHOLE.format('cv2')}"
    said[-1] = f"echotruth: a.onnx needs the package onnxruntime: {installation('onnx')}"
    assert (done.returncode, done.stderr.splitlines()) == (0, said)


def test_job_scores_a_tracker_of_ones_own_in_the_light_installation(tmp_path):
    shutil.copytree(et.sample().folder, tmp_path / "copy")
    (tmp_path / "absent").mkdir()
    for name in MAKE:  # also for the process of the job
        (tmp_path / f"absent/{name}.py").write_text(f"raise ModuleNotFoundError('no {name}', name='{name}')\n")
    still = "def track(frames, points, *rest):\n    return np.zeros((len(frames), len(points), 2))\n"
    (tmp_path / "still.py").write_text(f"import numpy as np\n\n\n{still}")
    paths = os.pathsep.join([str(tmp_path / "absent"), *filter(None, [os.environ.get("PYTHONPATH")])])
    chosen = ["evaluate", "copy", "--tracker", "still:track", "--case", "healthy", "--view", "mid"]
    command, environment = [sys.executable, "-m", "echotruth", *chosen], os.environ | {"PYTHONPATH": paths}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "still is a tracker of" in done.stdout


def test_functions_that_need_more_say_which_extra(tmp_path):
    program = """
import echotruth as et
try:
    et.beat()
except ImportError as error:
    print(error)
"""
    said = [f"echotruth.beat {WHOLE.format('numba')}"]
    assert light(program, tmp_path).stdout.splitlines() == said


@pytest.mark.parametrize(("note", "command"), [
    (None, "pip install 'echotruth[make]'"),
    ({"url": "file:///gone/echotruth", "dir_info": {}}, "pip install 'echotruth[make]'"),
    ({"url": "https://example.org/echotruth.whl", "archive_info": {}}, "pip install 'echotruth[make]'"),
    ({"url": "FOLDER", "dir_info": {}}, "pip install 'FOLDER[make]'"),
    ({"url": "FOLDER", "dir_info": {"editable": True}}, "pip install -e 'FOLDER[make]'"),
])  # fmt: skip
def test_extra_is_installed_from_where_the_package_came(tmp_path, monkeypatch, note, command):
    folder = tmp_path / "a folder"
    information = tmp_path / "site/echotruth-0.dist-info"
    for path in (folder, information):
        path.mkdir(parents=True)
    (information / "METADATA").write_text("Name: echotruth\n")
    if note:
        text = json.dumps(note).replace("FOLDER", folder.as_uri())
        (information / "direct_url.json").write_text(text)
    monkeypatch.setattr(sys, "path", [str(tmp_path / "site")])
    assert installation("make") == command.replace("FOLDER", str(folder))


def test_extra_has_the_packages_that_are_named():
    named = {"cv2": "opencv-python-headless", "skimage": "scikit-image", "imageio_ffmpeg": "imageio-ffmpeg"}
    extra = {Requirement(entry).name for entry in PROJECT["optional-dependencies"]["make"]}
    assert {named.get(package, package) for package in MAKE} == extra

"""A repository that grew equals one that was made at once, byte for byte, scores included."""

import os
import shutil
import signal
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path

import cores
import pytest
import yaml

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
TRACKERS = {
    "wall": {"method": "bspline_dic"},
    "as_published": {"method": "phase_correlation", "window_px": 16},
    "dis": {"method": "dis"},
}
"""In an order that is neither that of their names nor that in which they are added."""
CONFIG = {
    "name": "tiny",
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
    "loop": {"frames": 4},
    "motion": {"kind": "rigid"},
    "views": {"mid": {"position": 0.5}, "apex": {"position": 0.7}},
    "phantom": {"density_per_mm3": 50},
    "probe": {"elements": 16},
    "rf": {"lines": 32, "focal_zones": 1},
    "bmode": {"size_px": 256, "downsampling": [1, 2, 4]},  # 256, 128, 64: in another order as text
    "tracking": {"trackers": TRACKERS},
    "cases": {"seed": [1, 2]},
}


def smaller(**changes):
    """The configuration with some sections replaced."""
    return CONFIG | changes


def without_tracker(name):
    return smaller(tracking={"trackers": {key: value for key, value in TRACKERS.items() if key != name}})


BEFORE = {
    "a tracker": without_tracker("as_published"),
    "the first tracker": without_tracker("wall"),
    "a size": smaller(bmode={"size_px": 256, "downsampling": [1, 4]}),
    "a view": smaller(views={"mid": {"position": 0.5}}),
    "a case": smaller(cases={"seed": [1]}),
}
"""What a repository lacked before it grew -> its configuration then."""


class Folder:
    """Folder in which repositories are made."""

    def __init__(self, path):
        self.path = path
        path.mkdir(exist_ok=True)
        cores.lend(path / ".snakemake/numba")

    def start(self, *command):
        environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "MPLBACKEND": "agg"}
        code = [sys.executable, "-c", "from echotruth.cli import main; main()"]
        return subprocess.Popen(
            [*code, *command],
            cwd=self.path,
            env=environment,
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def do(self, *command, status=0):
        process = self.start(*command)
        output, _ = process.communicate()
        assert process.returncode == status, output
        return output

    def write(self, config):
        name = f"{config['name']}.yaml"
        (self.path / name).write_text(yaml.dump(config, sort_keys=False))
        return name

    def make(self, config):
        """Make the repository of a configuration, without its report."""
        self.do("run", self.write(config), "--cores", "2", "repository")
        return self.path / "out" / config["name"]


def contents(folder):
    """Path in the store -> hash, of every file of a repository."""
    store = folder / f"{folder.name}.zarr"
    files = (path for path in store.rglob("*") if path.is_file())
    return {path.relative_to(store).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


def assert_same(folder, whole):
    found, expected = contents(folder), contents(whole)
    assert sorted(found) == sorted(expected)
    assert [path for path in found if found[path] != expected[path]] == []


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A repository that was made at once."""
    return Folder(tmp_path_factory.mktemp("whole") / "echotruth").make(CONFIG)


@pytest.mark.parametrize("lacking", BEFORE)
def test_repository_that_got_what_it_lacked_equals_one_made_at_once(whole, tmp_path, lacking):
    grown = Folder(tmp_path / "echotruth")
    grown.make(BEFORE[lacking])
    assert_same(grown.make(CONFIG), whole)


def test_repository_that_grew_step_by_step_equals_one_made_at_once(whole, tmp_path):
    grown, config = Folder(tmp_path / "echotruth"), CONFIG
    steps = [CONFIG]
    for before in BEFORE.values():
        changed = {key: value for key, value in before.items() if value != CONFIG[key]}
        config = config | changed
        steps.append(config)
    for config in reversed(steps):
        folder = grown.make(config)
    assert_same(folder, whole)


@pytest.mark.parametrize("stage", ["phantom", "rf", "tracking"])
def test_run_killed_while_a_stage_is_made_and_continued_gives_the_same_bytes(whole, tmp_path, stage):
    folder = Folder(tmp_path / "echotruth")
    process = folder.start("run", folder.write(CONFIG), "--cores", "1", "repository")
    records = folder.path / "out/tiny/ledger" / stage
    while process.poll() is None and not list(records.rglob("*.json")):
        time.sleep(0.05)
    assert process.poll() is None, process.stdout.read()
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert_same(folder.make(CONFIG), whole)


@pytest.mark.parametrize("group", ["tracking", "evaluation", "bmode", "mechanics"])
def test_damaged_repository_that_was_healed_equals_one_made_at_once(whole, tmp_path, group):
    folder = Folder(tmp_path / "echotruth")
    shutil.copytree(whole.parents[1], folder.path, dirs_exist_ok=True, ignore=shutil.ignore_patterns("numba"))
    shard = min(path for path in (folder.path / "out/tiny/tiny.zarr" / group).rglob("c/0/**/0") if path.is_file())
    shard.write_bytes(shard.read_bytes()[:-1])
    folder.do("check", "out/tiny", "--heal", status=1)
    assert_same(folder.make(CONFIG), whole)


def test_merged_repository_equals_one_made_at_once(whole, tmp_path):
    folder = Folder(tmp_path / "echotruth")
    first = folder.make(smaller(name="first", cases={"seed": [1]}))
    second = folder.make(smaller(name="second", cases={"seed": [2]}))
    folder.do("merge", "out/tiny", str(first), str(second))
    merged = contents(folder.path / "out/tiny")
    own = {path: hash for path, hash in contents(whole).items() if "/c/" in path and not path.startswith("cases/")}
    assert {path: merged[path] for path in own} == own


def test_braces_in_a_configuration_are_text_and_not_wildcards(tmp_path):
    command = [sys.executable, "-c", "raise SystemExit(1)", "{input}", "{output}"]
    external = {"external": {"method": "external", "command": command}, "dis": {"method": "dis"}}
    note = {"cases": {"table": "case,seed,note\na,1,{why} {not}\n"}}
    folder = Folder(tmp_path / "echotruth").make(smaller(tracking={"trackers": external}, **note))
    assert (folder / "ledger/repository.json").is_file()

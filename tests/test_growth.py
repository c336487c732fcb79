"""A repository that grew equals one that was made at once, byte for byte, scores included."""

import shutil
import sys

import pytest
import yaml
from workspace import COMMAND, Workspace, contents, differing

pytestmark = pytest.mark.slow

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
    "cases": {"seed": [1]},
}
TWO_CASES = {"seed": [1, 2]}
ONE_OF_EACH = {
    "views": {"mid": {"position": 0.5}},
    "bmode": {"size_px": 64, "downsampling": [1]},
    "tracking": {"trackers": {"dis": {"method": "dis"}}},
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
}
"""What a repository lacked before it grew -> its configuration then."""


class Folder(Workspace):
    """Folder in which repositories are made."""

    def __init__(self, path, config=CONFIG):
        super().__init__(path, text(config))

    def make(self, config):
        """Make the repository of a configuration, without its report."""
        self.echotruth("run", self.write(text(config), config["name"]), "--cores", "2", "repository")
        return self.folder / "out" / config["name"]


def text(config):
    return yaml.dump(config, sort_keys=False)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A repository that was made at once."""
    return Folder(tmp_path_factory.mktemp("whole") / "echotruth").make(CONFIG)


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """A repository of two cases that was made at once."""
    return Folder(tmp_path_factory.mktemp("two") / "echotruth").make(smaller(cases=TWO_CASES))


def copied(whole, folder):
    """Folder with a copy of a repository, and of what Snakemake knows of it."""
    shutil.copytree(whole.parents[1], folder.folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("numba"))
    return folder


def test_repository_that_got_a_case_equals_one_made_at_once(whole, two, tmp_path):
    grown = copied(whole, Folder(tmp_path / "echotruth"))
    assert differing(grown.make(smaller(cases=TWO_CASES)), two) == []


def test_repository_that_grew_step_by_step_equals_one_made_at_once(whole, tmp_path):
    grown, config = Folder(tmp_path / "echotruth"), CONFIG
    steps = [CONFIG]
    for before in BEFORE.values():
        changed = {key: value for key, value in before.items() if value != CONFIG[key]}
        config = config | changed
        steps.append(config)
    for config in reversed(steps):
        folder = grown.make(config)
    assert differing(folder, whole) == []


# benchmarks/endurance.py kills at all stages.
def test_run_killed_while_a_stage_is_made_and_continued_gives_the_same_bytes(whole, tmp_path):
    folder = Folder(tmp_path / "echotruth")
    run = folder.start(*COMMAND, "run", "tiny.yaml", "--cores", "1", "repository")
    folder.kill_when(run, lambda: folder.has("ledger/rf/**/*.json"))
    assert differing(folder.make(CONFIG), whole) == []
    assert not (folder.out / "scratch").exists()


def test_run_killed_while_a_repository_grows_and_continued_gives_the_same_bytes(whole, tmp_path):
    folder = Folder(tmp_path / "echotruth")
    folder.make(BEFORE["a view"])
    run = folder.start(*COMMAND, "run", folder.write(text(CONFIG)), "--cores", "1", "repository")
    folder.kill_when(run, lambda: not folder.has("ledger/repository.json"))
    assert differing(folder.make(CONFIG), whole) == []


def test_damaged_repository_that_was_healed_equals_one_made_at_once(whole, tmp_path):
    folder = copied(whole, Folder(tmp_path / "echotruth"))
    shard = min(path for path in (folder.out / "tiny.zarr/mechanics").rglob("c/0/**/0") if path.is_file())
    shard.write_bytes(shard.read_bytes()[:-1])
    folder.echotruth("check", "out/tiny", "--heal", status=1)
    assert differing(folder.make(CONFIG), whole) == []


def test_merged_repository_equals_one_made_at_once(tmp_path, tmp_path_factory):
    folder, small = Folder(tmp_path / "echotruth"), smaller(**ONE_OF_EACH)
    first = folder.make(small | {"name": "first"})
    second = folder.make(small | {"name": "second", "cases": {"seed": [2]}})
    folder.echotruth("merge", "out/tiny", str(first), str(second))
    merged = contents(folder.out)
    two = Folder(tmp_path_factory.mktemp("two") / "echotruth").make(small | {"cases": TWO_CASES})
    own = {path: hash for path, hash in contents(two).items() if "/c/" in path and not path.startswith("cases/")}
    assert {path: merged[path] for path in own} == own


def test_braces_in_a_configuration_are_text_and_not_wildcards(tmp_path):
    command = [sys.executable, "-c", "raise SystemExit(1)", "{input}", "{output}"]
    external = {"external": {"method": "external", "command": command}, "dis": {"method": "dis"}}
    note = {"cases": {"table": "case,seed,note\na,1,{why} {not}\n"}}
    config = smaller(**ONE_OF_EACH) | {"tracking": {"trackers": external}} | note
    folder = Folder(tmp_path / "echotruth").make(config)
    assert (folder / "ledger/repository.json").is_file()

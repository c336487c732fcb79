"""A repository that was killed, changed, damaged, merged, or that grew, equals one made at once, byte for byte."""

import shutil
import sys
import time

import psutil
import pytest
import yaml
from workspace import COMMAND, SECONDS, Workspace, differing, planned

from echotruth.workflow.lease import VARIABLE

pytestmark = pytest.mark.slow

TRACKERS = {
    "wall": {"method": "bspline_dic"},
    "absent": {"method": "external", "command": [sys.executable, "-c", "raise SystemExit(1)", "{input}", "{output}"]},
    "dis": {"method": "dis"},
}
"""In an order that is neither that of their names nor that in which they are added."""
CONFIG = {
    "name": "tiny",
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
    "loop": {"frames": 4},
    "views": {"mid": {"position": 0.5}, "apex": {"position": 0.7}},
    "phantom": {"density_per_mm3": 50},
    "probe": {"elements": 16},
    "rf": {"lines": 32, "focal_zones": 1, "keep": ["lines", "channels"]},
    "bmode": {"size_px": 96, "downsampling": [1, 2]},  # 96, 48: in another order as text
    "tracking": {"trackers": TRACKERS},
    "cases": {"table": "case,seed,note\none,1,braces are no {wildcards} of Snakemake\ntwo,2,\n"},
}
ONE = CONFIG | {"cases": {"table": CONFIG["cases"]["table"].replace("two,2,\n", "")}}
TWO = CONFIG | {"cases": {"table": "case,seed,note\ntwo,2,\n"}}
FEWER = ONE | {
    "bmode": {"size_px": 96, "downsampling": [1]},
    "tracking": {"trackers": {name: TRACKERS[name] for name in ("absent", "dis")}},
}
"""One case without its second size and its first tracker."""
FIRST = FEWER | {
    "views": {"mid": {"position": 0.5}},
    "probe": {"elements": 20},
    "tracking": {"trackers": {"dis": TRACKERS["dis"]}},
}
"""One view by one tracker, with another probe."""


class Folder(Workspace):
    """Folder in which repositories are made."""

    def __init__(self, path, config=CONFIG):
        super().__init__(path, text(config))

    def command(self, config, cores):
        """Command that makes the repository of a configuration, without its report."""
        return *COMMAND, "run", self.write(text(config)), "--cores", str(cores), "repository"

    def make(self, config, cores=2):
        """Make the repository of a configuration; rule -> number of its jobs."""
        self.run(*self.command(config, cores))
        return planned((self.out / "logs/snakemake.log").read_text())

    def times(self, pattern):
        """Path -> time of the last change, of the files of a pattern."""
        return {path: path.stat().st_mtime_ns for path in self.out.glob(pattern)}

    def writers(self):
        """Runs with a script of a stage at work in the folder, by their names."""
        runs = set()
        for process in psutil.process_iter():
            try:
                if any("/scripts/" in part for part in process.cmdline()) and process.cwd() == str(self.folder):
                    runs.add(process.environ().get(VARIABLE))
            except psutil.Error:
                continue
        return runs


def text(config):
    return yaml.dump(config, sort_keys=False)


def copied(made, path):
    """Folder with a copy of a repository, and of what Snakemake knows of it."""
    folder = Folder(path)
    shutil.copytree(made.folder, folder.folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("numba"))
    return folder


def wait_for(condition):
    """What a condition gives as soon as it holds."""
    end = time.monotonic() + SECONDS
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.1)
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder in which the repository was made at once, on two cores."""
    folder = Folder(tmp_path_factory.mktemp("whole") / "echotruth")
    folder.make(CONFIG)
    return folder


# benchmarks/endurance.py kills at random moments: all processes, the runner, Snakemake or one job.
@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A folder whose run on one core was killed as it imaged, and continued; times of the mechanics at the kill."""
    folder = Folder(tmp_path_factory.mktemp("killed") / "echotruth")
    run = folder.start(*folder.command(FIRST, 1))
    folder.kill_when(run, lambda: folder.has("ledger/rf/**/*.json"))
    mechanics = folder.times("ledger/mechanics/*.json")
    folder.make(FIRST, 1)
    return folder, mechanics


@pytest.fixture(scope="module")
def orphaned(killed):
    """The folder with another probe, a view and a tracker, whose runner alone was killed; runs at work since then."""
    folder, _ = killed
    command = folder.command(FEWER, 2)
    run = folder.start(*command)
    (old,) = wait_for(lambda: any(folder.out.glob("logs/rf/*/apex.log")) and folder.writers())
    run.kill()
    run.communicate()
    run, seen = folder.start(*command), []
    while run.poll() is None:
        seen.append(folder.writers())
        time.sleep(0.5)
    assert run.returncode == 0, run.communicate()[0]
    return folder, old, seen


@pytest.fixture(scope="module")
def one(orphaned):
    """The folder with a size and the first tracker too, which is all of the first case; the jobs that made them."""
    folder, *_ = orphaned
    return folder, folder.make(ONE)


def test_killed_run_that_is_continued_keeps_its_mechanics_and_leaves_no_scratch_files(killed):
    folder, mechanics = killed
    assert mechanics and folder.times("ledger/mechanics/*.json") == mechanics
    assert not (folder.out / "scratch").exists()


def test_run_after_one_whose_runner_alone_was_killed_works_alone(orphaned):
    _, old, seen = orphaned
    new = [runs for runs in seen if runs and runs != {old}]
    assert new and all(len(runs) == 1 and old not in runs for runs in new)
    assert len({run for runs in new for run in runs}) == 1


def test_repository_that_was_killed_changed_and_grew_step_by_step_equals_one_made_at_once(whole, one, tmp_path):
    folder, jobs = one
    assert jobs == {"truth": 2, "bmode": 2, "tracking": 4, "repository": 1}
    grown = copied(folder, tmp_path / "echotruth")
    jobs = {"mechanics": 1, "phantom": 2, "rf": 2, "truth": 4, "bmode": 4, "tracking": 4, "repository": 1}
    assert grown.make(CONFIG, cores=1) == jobs
    assert differing(grown.out, whole.out) == []


def test_merged_repository_equals_one_made_at_once_and_is_run_again_only_where_settings_change(whole, one, tmp_path):
    second, merged = Folder(tmp_path / "second"), Folder(tmp_path / "echotruth")
    second.make(TWO)
    merged.echotruth("merge", "out/tiny", str(one[0].out), str(second.out))
    assert differing(merged.out, whole.out) == []
    assert set(merged.planned()) <= {"repository", "report"}
    trackers = TRACKERS | {"dis": {"method": "dis", "preset": "fast"}}
    changed = CONFIG | {"tracking": {"trackers": trackers}, "bmode": FEWER["bmode"]}  # and a size less
    assert merged.planned(text(changed)) == {"tracking": 4, "repository": 1, "report": 1}
    assert "no faults" in merged.echotruth("check", "out/tiny")


@pytest.fixture(scope="module")
def damaged(whole, tmp_path_factory):
    """A copy of the repository, to be damaged and healed."""
    return copied(whole, tmp_path_factory.mktemp("damaged") / "echotruth")


def damage(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.unlink()  # hearts may share its data
    path.write_bytes(content)


# benchmarks/damage.py damages at random, in all ways.
def test_damaged_shards_are_made_again_with_what_depends_on_them_and_nothing_else(damaged, whole):
    names = ["phantom/origin/c/0/0/0", "tracking/48/dis/quality/c/1/1/0/0/0"]  # of the first case, and of the second
    for name in names:
        damage(damaged.out / "tiny.zarr" / name)
    told = damaged.echotruth("check", "out/tiny", "--heal", status=1)
    assert all(f"tiny.zarr/{name}: differs from what was written" in told for name in names)
    assert damaged.make(CONFIG) == {"phantom": 1, "rf": 1, "bmode": 2, "tracking": 3, "repository": 1}
    assert differing(damaged.out, whole.out) == []


def test_damaged_structure_is_laid_out_again_and_no_job_is_run(damaged, whole):
    records = damaged.times("ledger/*/**/*.json")
    for name in ("zarr.json", "mechanics/displacement/zarr.json", "cases/status/c/0", "truth/48/view/c/0"):
        damage(damaged.out / "tiny.zarr" / name)
    damaged.echotruth("check", "out/tiny", "--heal", status=1)
    assert damaged.make(CONFIG) == {"repository": 1}
    assert differing(damaged.out, whole.out) == []
    assert damaged.times("ledger/*/**/*.json") == records
    assert set(damaged.planned()) == {"report"}, "nothing else is left to be done"

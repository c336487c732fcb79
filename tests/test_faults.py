"""A finished repository on a damaged disk: the commands find what is damaged, and a run makes it again and no more."""

import os
import re
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import cores
import pytest

ROOT = Path(__file__).parents[1]
CONFIG = """\
name: {name}
geometry: {{circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1}}
loop: {{frames: 4}}
motion: {{kind: affine}}
views: {{mid: {{position: 0.5}}, apex: {{position: 0.8}}}}
phantom: {{density_per_mm3: 50}}
probe: {{elements: 16}}
rf: {{lines: 32}}
bmode: {{size_px: 64, downsampling: [1]}}
tracking: {{trackers: {{one: {{window_px: {window}}}}}}}
cases: {{seed: {seeds}}}
"""

pytestmark = pytest.mark.slow


class Workspace:
    """Folder in which the commands are run; it shares the compiled functions of the tests."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.out = folder, folder / "out"
        cores.lend(folder / ".snakemake/numba")

    def configure(self, name: str, seeds: list[int], window: int = 16) -> str:
        (self.folder / f"{name}.yaml").write_text(CONFIG.format(name=name, seeds=seeds, window=window))
        return f"{name}.yaml"

    def run(self, *arguments: str, status: int = 0) -> str:
        """Output of a command."""
        environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "MPLBACKEND": "agg"}
        command = [sys.executable, "-c", "from echotruth.cli import main; main()", *arguments]
        result = subprocess.run(
            command, cwd=self.folder, env=environment, stdout=-1, stderr=subprocess.STDOUT, text=True, check=False
        )
        assert result.returncode == status, result.stdout
        return result.stdout

    def planned(self, config: str) -> dict[str, int]:
        """Rule -> number of jobs that a run would start."""
        output = self.run("run", config, "-n", "--cores", "2")
        return {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE)}

    def content(self, name: str) -> dict[Path, str]:
        files = [path for path in (self.out / name / f"{name}.zarr").rglob("*") if path.is_file()]
        return {path: sha256(path.read_bytes()).hexdigest() for path in files}

    def times(self, name: str) -> dict[Path, int]:
        return {path: path.stat().st_mtime_ns for path in (self.out / name / "ledger").rglob("*.json")}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory) -> Workspace:
    made = Workspace(tmp_path_factory.mktemp("faults"))
    made.run("run", made.configure("first", [1, 2]), "--cores", "2")
    return made


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.unlink()  # hearts may share its data
    path.write_bytes(content)


@pytest.mark.parametrize(
    "name, stages",
    [
        ("tracking/64/one/quality/c/0/1/0/0/0", {"tracking"}),
        ("phantom/origin/c/0/0/0", {"phantom", "rf", "bmode", "tracking"}),
    ],
)
def test_damaged_shard_is_made_again_with_what_depends_on_it_and_nothing_else(workspace, name, stages):
    folder = workspace.out / "first"
    before = workspace.content("first")
    logs = {path: path.stat().st_mtime_ns for path in folder.glob("logs/*/**/*.log")}
    damage(folder / "first.zarr" / name)
    assert f"first.zarr/{name}: differs from what was written" in workspace.run(
        "check", "out/first", "--heal", status=1
    )
    workspace.run("run", "first.yaml", "--cores", "2")
    assert workspace.content("first") == before
    written = [path for path in folder.glob("logs/*/**/*.log") if path.stat().st_mtime_ns != logs.get(path)]
    assert sorted(path.relative_to(folder / "logs").parts[0] for path in written) == sorted(stages)
    assert workspace.planned("first.yaml") == {}


def test_damaged_structure_is_laid_out_again_and_no_job_is_run(workspace):
    folder = workspace.out / "first"
    before, times = workspace.content("first"), workspace.times("first")
    logs = {path: path.stat().st_mtime_ns for path in folder.glob("logs/*/**/*.log")}
    for name in ("zarr.json", "mechanics/displacement/zarr.json", "cases/status/c/0", "truth/64/view/c/0"):
        damage(folder / "first.zarr" / name)
    workspace.run("check", "out/first", "--heal", status=1)
    workspace.run("run", "first.yaml", "--cores", "2")
    for name in ("structure", "repository"):  # written again
        times.pop(folder / f"ledger/{name}.json")
    assert workspace.content("first") == before
    assert {path: path.stat().st_mtime_ns for path in times} == times
    assert {path: path.stat().st_mtime_ns for path in folder.glob("logs/*/**/*.log")} == logs


def test_merged_repository_is_run_again_only_where_settings_change(workspace):
    workspace.run("run", workspace.configure("second", [3]), "--cores", "2", "repository")  # without its report
    workspace.run("merge", "out/both", "out/first", "out/second")
    jobs = workspace.planned(workspace.configure("both", [1, 2, 3]))
    assert set(jobs) <= {"report", "all", "total"}
    jobs = workspace.planned(workspace.configure("both", [1, 2, 3], window=20))
    assert jobs["tracking"] == 6 and not {"mechanics", "phantom", "rf", "truth", "bmode"} & set(jobs)
    assert "no faults" in workspace.run("check", "out/both")

"""The whole workflow on coarse hearts: results, reruns, and that a continued run gives the same bytes."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path

import cores
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import echotruth as et
from echotruth.workflow.instructions import LEVEL, environment

ROOT = Path(__file__).parents[1]
CONFIG = """\
name: tiny
geometry: {circumferential_elements: 12, longitudinal_elements: 6, transmural_elements: 1}
loop: {frames: 6}
views:
  mid: {position: 0.5}
  long_axis: {plane: long_axis}
phantom: {density_per_mm3: 200}
probe: {elements: 16}
rf: {lines: 64, keep: [lines, channels]}
bmode: {size_px: 128, downsampling: [1, 2]}
tracking:
  trackers:
    as_published: {window_px: 16}
    corrected: {window_px: 16, taper: hann, reference: previous}
    wall: {method: bspline_dic}
    absent: {method: external, track: "absent:track"}
cases:
  seed: [1, 2]
"""
SNAKEMAKE = ("-m", "snakemake", "--snakefile", str(ROOT / "src/echotruth/workflow/Snakefile"))
"""The workflow, without the command that runs it."""
RUN = "from echotruth.cli import main; main()"
"""The command `echotruth`, without its entry point."""


class Workspace:
    """Empty folder with a configuration, in which the workflow of the package is run.

    It uses the compiled functions of the tests, unless `share_cache` is false.
    """

    def __init__(self, folder, share_cache=True):
        self.folder = folder
        folder.mkdir(exist_ok=True)
        if share_cache:
            cores.lend(folder / ".snakemake/numba")
        (folder / "tiny.yaml").write_text(CONFIG)
        self.out = folder / "out/tiny"

    def start(self, *command):
        """Start a process in its own process group."""
        environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "MPLBACKEND": "agg"}
        return subprocess.Popen(
            [sys.executable, *command],
            cwd=self.folder,
            env=environment,
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def run(self, *command):
        """Output of a process that must succeed."""
        process = self.start(*command)
        output, _ = process.communicate()
        assert process.returncode == 0, output
        return output

    def snakemake(self, *options):
        return self.run(*SNAKEMAKE, "--configfile", "tiny.yaml", *options)

    @property
    def bytes(self):
        """Path in the store -> hash, of every file."""
        root = self.out / "tiny.zarr"
        files = [path for path in root.rglob("*") if path.is_file()]
        return {path.relative_to(root).as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder in which the workflow ran on two cores."""
    workspace = Workspace(tmp_path_factory.mktemp("first") / "echotruth")
    workspace.snakemake("--cores", "2")
    return workspace


@pytest.fixture(scope="module")
def tree(made):
    with xr.open_datatree(made.out / "tiny.zarr") as opened:
        yield opened


def test_clip_read_at_a_notebook_is_tracked_and_scored_as_the_workflow_does(made, tree):
    folder, case = made.out, str(tree["bmode/128"]["case"].values[0])
    heart, clip = et.Repository(folder).heart(case), et.Repository(folder).clip(case, "long_axis", 64)
    tracked = et.track(clip, "corrected")
    place = {"case": case, "view": "long_axis", "size": 64, "tracker": "corrected"}
    stored = tree["tracking"].to_dataset().sel(place)
    np.testing.assert_array_equal(tracked["displacement"], stored["displacement"])
    nrmse = tree["evaluation"].to_dataset().scores.sel(place | {"score": "nrmse_all"})
    assert et.evaluate(tracked, heart)["nrmse_all_percent"] == 100 * float(nrmse)


def documented():
    """Heading in docs/schema.md -> array -> dimensions, type, units and long name."""
    groups, heading = {}, None
    for line in (ROOT / "docs/schema.md").read_text().splitlines():
        if line.startswith(("## ", "### ")):
            heading = line.lstrip("# ")
            groups[heading] = {}
        elif line.startswith("| `"):
            name, dims, dtype, units, _, long_name = (cell.strip() for cell in line.strip("|").split("|"))
            groups[heading][name.strip("`")] = (tuple(dims.split(", ")), dtype, units, long_name)
    return groups


def found(variable):
    dtype = "string" if variable.dtype.kind in "OTU" else str(variable.dtype)
    return variable.dims, dtype, variable.attrs.get("units"), variable.attrs.get("long_name")


def expected(coordinates, arrays):
    """Arrays of a group and the coordinates of their dimensions."""
    dims = {dim for array in arrays.values() for dim in array[0]}
    return {name: row for name, row in coordinates.items() if dims >= set(row[0])} | arrays


def test_tree_holds_what_the_schema_page_says_and_nothing_else(made, tree):
    groups = documented()
    coordinates = groups.pop("Coordinates")
    cases = groups.pop("cases")
    groups = {path: rows for path, rows in groups.items() if " " not in path}  # no members of packs
    paths = {path.replace("SIZE", size): rows for path, rows in groups.items() for size in ("128", "64")}
    nodes = {node.path.strip("/"): node.to_dataset(inherit=False).variables for node in tree.subtree}
    nodes = {path: variables for path, variables in nodes.items() if variables}
    assert set(nodes) == {*paths, "cases"}
    for path, rows in paths.items():
        assert {name: found(variable) for name, variable in nodes[path].items()} == expected(coordinates, rows), path
    keys = set(pd.read_csv(made.out / "cases.csv").columns) - {"case", "seed"}
    assert set(nodes["cases"]) == {*cases, "case", "seed"}  # only the seed differs
    assert set(tree["cases"].attrs["constants"]) == keys
    assert all(variable.dims == ("case",) for variable in nodes["cases"].values())


def test_every_array_has_named_dimensions_units_and_a_long_name(tree):
    for node in tree.subtree:
        for name, variable in node.to_dataset(inherit=False).variables.items():
            assert not any(dim.startswith("dim_") for dim in variable.dims), name
            assert variable.attrs["units"] and variable.attrs["long_name"], name


def test_root_says_what_the_repository_is(tree):
    assert {"title", "summary", "references", "config", "seed", "code", "packages"} <= set(tree.attrs)
    assert set(tree["cases/status"].values) == {"complete"}


def test_loop_is_met_at_every_frame_without_loss_of_volume(tree):
    mechanics, kinematics = tree["mechanics"], tree["kinematics"]
    for name in ("pressure", "volume"):
        np.testing.assert_allclose(mechanics[name], mechanics[f"{name}_target"], rtol=5e-3)
    assert float(kinematics["volume_ratio_min"].min()) > 0
    assert float(abs(kinematics["volume_ratio_mean"] - 1).max()) < 0.02


def test_seeds_differ_in_speckle_and_not_in_mechanics(tree):
    displacement, image = tree["mechanics/displacement"].values, tree["bmode/128/image"].values
    np.testing.assert_array_equal(displacement[0], displacement[1])
    assert (image[0] != image[1]).any()


def test_every_view_shows_wall_and_speckle_and_is_tracked(tree):
    for size in (128, 64):
        assert (tree[f"truth/{size}/labels"].sel(label="layer") > 0).any(("axial", "lateral")).all()
        assert (tree[f"bmode/{size}/image"].std(("axial", "lateral")) > 5).all()
    coverage = tree["evaluation/scores"].sel(score="coverage", tracker=["as_published", "corrected", "wall"])
    assert coverage.sizes["size"] == 2 and (coverage > 0.5).all()


def test_a_tracker_that_fails_is_a_row_of_the_leaderboard_and_not_the_end_of_the_run(made, tree):
    assert (tree["evaluation/scores"].sel(score="coverage", tracker="absent", size=128) == 0).all()
    record = json.loads(next((made.out / "ledger/tracking").glob("*/mid.json")).read_text())
    assert set(record["failures"]) == {"absent/128", "absent/64"}
    assert "cannot be imported" in record["failures"]["absent/64"]
    board = pd.read_csv(made.out / "figures/leaderboard.csv").set_index(["size_px", "view", "tracker"])
    assert board.loc[(128, "all", "absent"), "failures"] == 4
    assert board.loc[(128, "all", "absent"), "nrmse_all_percent"] == pytest.approx(100)
    assert board.loc[(128, "all", "wall"), "rank"] == 1


def test_figures_stand_beside_the_repository_and_of_scratch_only_checkpoints_stay(made):
    assert {path.suffix for path in (made.out / "figures").iterdir()} == {".png", ".svg", ".gif", ".csv", ".mp4"}
    left = {path.name for path in made.out.glob("scratch/**/*") if path.is_file()}
    assert left == {"checkpoint.json"}


@pytest.mark.slow
def test_jobs_of_a_view_find_all_that_they_call_compiled(tmp_path):
    """The miniature compiles all functions that the jobs call, with the same types."""
    made = Workspace(tmp_path / "echotruth", share_cache=False)
    (made.folder / "tiny.yaml").write_text(CONFIG.replace("[1, 2]\n", "[1]\n").replace("frames: 6", "frames: 4"))
    made.snakemake("--cores", "2", "--until", "tracking")
    records = [json.loads(path.read_text()) for path in made.out.glob("ledger/*/*/*.json")]
    assert {record["stage"] for record in records} == {"phantom", "truth", "rf", "bmode", "tracking", "evaluation"}
    assert {record["stage"]: record["compile_seconds"] for record in records if record["compile_seconds"]} == {}
    assert "miniature failed" not in "".join(path.read_text() for path in made.out.glob("logs/**/*.log"))


def test_every_record_names_the_instructions_that_its_job_used(made):
    records = [json.loads(path.read_text()) for path in (made.out / "ledger").rglob("*.json")]
    used = {record["instructions"] for record in records if "stage" in record}
    assert len(used) == 1
    assert used.pop().startswith(LEVEL if environment() else "native ")


def test_second_run_has_nothing_to_do(made):
    assert "Nothing to be done" in made.snakemake("-n", "--cores", "2")


def planned(made, text):
    """Rule -> number of jobs that a configuration would run."""
    (made.folder / "changed.yaml").write_text(text)
    output = made.run(*SNAKEMAKE, "-n", "--configfile", "changed.yaml", "--cores", "2")
    return {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE)}


def test_changed_tracker_reruns_tracking_and_what_follows_it(made):
    jobs = planned(made, CONFIG.replace("as_published: {window_px: 16}", "as_published: {window_px: 32}"))
    assert jobs["tracking"] == 4 and jobs["repository"] == jobs["report"] == 1
    assert not {"mechanics", "imaging"} & set(jobs)


@pytest.mark.slow
def test_changed_probe_reruns_imaging_and_not_mechanics(made):
    jobs = planned(made, CONFIG.replace("elements: 16}", "elements: 20}"))
    assert jobs["imaging"] == jobs["tracking"] == 4
    assert "mechanics" not in jobs


@pytest.mark.slow
def test_changed_bound_solves_no_heart_again(made):
    jobs = planned(made, CONFIG + "physiology: {twist_max_deg: 50}\n")
    assert (jobs["physiology"], jobs["imaging"], jobs["tracking"]) == (2, 4, 4)
    assert "mechanics" not in jobs


@pytest.mark.slow
def test_changed_mechanics_reruns_everything(made):
    jobs = planned(made, CONFIG + "mechanics: {base: fixed}\n")
    assert (jobs["mechanics"], jobs["imaging"], jobs["tracking"]) == (2, 4, 4)


@pytest.mark.slow
@pytest.mark.parametrize("stage, rule", [("phantom", "imaging"), ("bmode", "imaging"), ("tracking", "tracking")])
def test_record_that_a_failed_job_lost_is_made_again(made, stage, rule):
    record = next(made.out.glob(f"ledger/{stage}/*/mid.json"))
    aside = record.rename(made.folder / "aside.json")
    try:
        assert planned(made, CONFIG).get(rule) == 1
    finally:
        aside.rename(record)


@pytest.fixture(scope="module")
def killed(made, tmp_path_factory):
    """Checkout whose run on one core was killed during imaging, after mechanics, and then continued."""
    workspace = Workspace(tmp_path_factory.mktemp("second") / "echotruth")
    process = workspace.start(*SNAKEMAKE, "--configfile", "tiny.yaml", "--cores", "1")
    end = time.monotonic() + 600
    while not list(workspace.out.glob("scratch/*/*/phantom.npz")):
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    before = {path: path.stat().st_mtime_ns for path in workspace.out.glob("ledger/mechanics/*.json")}
    unfinished = len(list(workspace.out.glob("ledger/bmode/*/*.json")))
    workspace.run("-c", RUN, "run", "tiny.yaml", "--cores", "1")
    return workspace, before, unfinished


@pytest.mark.slow
def test_killed_run_taken_up_again_gives_the_bytes_of_an_unbroken_run_on_more_cores(made, killed):
    workspace, _, unfinished = killed
    assert unfinished < 4
    first, second = made.bytes, workspace.bytes
    assert not [path for path in sorted({*first, *second}) if first.get(path) != second.get(path)]


@pytest.mark.slow
def test_killed_run_keeps_the_mechanics_it_had(killed):
    _, before, _ = killed
    assert before
    assert {path: path.stat().st_mtime_ns for path in before} == before


@pytest.mark.slow
def test_run_leaves_the_report_and_all_words_in_logs(killed):
    out = killed[0].out
    assert (out / "report.html").stat().st_size > 10_000
    assert "Job stats" in (out / "logs/snakemake.log").read_text()
    assert "done in" in next(out.glob("logs/imaging/*/mid.log")).read_text()

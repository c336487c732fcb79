"""The whole workflow on coarse hearts: results, reruns, and that a continued run gives the same bytes."""

import json
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from workspace import Workspace, differing

import echotruth as et
from echotruth.workflow.instructions import LEVEL, environment

ROOT = Path(__file__).parents[1]
TRACKERS = ("as_published", "corrected", "wall", "absent")
PLAIN = ("--snakefile", str(ROOT / "Snakefile"), "--configfile", "tiny.yaml", "--cores", "1")
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


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder in which the workflow ran on two cores."""
    workspace = Workspace(tmp_path_factory.mktemp("first") / "echotruth", CONFIG)
    workspace.snakemake("--configfile", "tiny.yaml", "--cores", "2")
    return workspace


@pytest.fixture(scope="module")
def tree(made):
    with xr.open_datatree(made.out / "tiny.zarr") as opened:
        yield opened


def test_clip_read_at_a_notebook_is_tracked_and_scored_as_the_workflow_does(made, tree):
    folder, case = made.out, str(tree["bmode/128"]["case"].values[0])
    heart, clip = et.Repository(folder).heart(case), et.Repository(folder).clip(case, "long_axis", 64)
    tracked = et.track(clip, "corrected")
    place = {"case": case, "view": "long_axis"}
    np.testing.assert_array_equal(tracked["displacement"], tree["tracking/64/corrected/displacement"].sel(place))
    nrmse = tree["evaluation/64/corrected/scores"].sel(place | {"score": "nrmse_all"})
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
    places = list(product(("128", "64"), TRACKERS))
    paths = {
        path.replace("SIZE", size).replace("TRACKER", tracker): rows
        for path, rows in groups.items()
        for size, tracker in places
    }
    nodes = {node.path.strip("/"): node.to_dataset(inherit=False).variables for node in tree.subtree}
    nodes = {path: variables for path, variables in nodes.items() if variables}
    assert set(nodes) == {*paths, "cases"}
    for path, rows in paths.items():
        # A group of a tracker has coordinates in common with that of its size, which xarray reads once.
        wanted, variables = expected(coordinates, rows), tree[path].to_dataset().variables
        assert {name: found(variables[name]) for name in wanted} == wanted, path
        assert set(nodes[path]) <= set(wanted), path
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
        for tracker in ("as_published", "corrected", "wall"):
            assert (tree[f"evaluation/{size}/{tracker}/scores"].sel(score="coverage") > 0.5).all(), (size, tracker)


def test_a_tracker_that_fails_is_a_row_of_the_leaderboard_and_not_the_end_of_the_run(made, tree):
    assert (tree["evaluation/128/absent/scores"].sel(score="coverage") == 0).all()
    for record in (made.out / "ledger/tracking").glob("*/mid/*.json"):
        failures = json.loads(record.read_text())["failures"]
        assert set(failures) == {"absent"} and "cannot be imported" in failures["absent"]
    board = pd.read_csv(made.out / "figures/leaderboard.csv").set_index(["size_px", "view", "tracker"])
    assert board.loc[(128, "all", "absent"), "failures"] == 4
    assert board.loc[(128, "all", "absent"), "nrmse_all_percent"] == pytest.approx(100)
    assert board.loc[(128, "all", "wall"), "rank"] == 1


def test_figures_stand_beside_the_repository_and_nothing_is_left_in_scratch(made):
    assert {path.suffix for path in (made.out / "figures").iterdir()} == {".png", ".svg", ".gif", ".csv", ".mp4"}
    assert not (made.out / "scratch").exists()


def test_every_record_names_the_instructions_that_its_job_used(made):
    records = [json.loads(path.read_text()) for path in (made.out / "ledger").rglob("*.json")]
    used = {record["instructions"] for record in records if "stage" in record}
    assert len(used) == 1
    assert used.pop().startswith(LEVEL if environment() else "native ")


def test_second_run_has_nothing_to_do(made):
    assert made.planned() == {}


END = {"repository": 1, "report": 1}
IMAGES = {"phantom": 4, "rf": 4, "bmode": 8, "tracking": 8, **END}
"""Jobs of two hearts with two views, of two sizes."""


@pytest.mark.parametrize(("old", "new", "jobs"), [
    ("as_published: {window_px: 16}", "as_published: {window_px: 32}", {"tracking": 8, **END}),
    ("    absent: {method: external, track: \"absent:track\"}\n", "", {"tracking": 8, **END}),
    ("downsampling: [1, 2]", "downsampling: [1, 2, 4]", {"truth": 4, "bmode": 4, "tracking": 4, **END}),
    ("downsampling: [1, 2]", "downsampling: [1]", END),
    ("  mid: {position: 0.5}\n", "  mid: {position: 0.5}\n  apex: {position: 0.7}\n",
     {"phantom": 2, "rf": 2, "truth": 4, "bmode": 4, "tracking": 4, **END}),
    ("mid: {position: 0.5}", "mid: {position: 0.6}",
     {"phantom": 2, "rf": 2, "truth": 4, "bmode": 4, "tracking": 4, **END}),
    ("seed: [1, 2]", "seed: [1, 2, 3]",
     {"mechanics": 1, "phantom": 2, "rf": 2, "truth": 4, "bmode": 4, "tracking": 4, **END}),
    ("elements: 16}", "elements: 20}", IMAGES),
    ("name: tiny\n", "name: tiny\nmechanics: {base: fixed}\n", {"mechanics": 2, "truth": 8, **IMAGES}),
    ("name: tiny\n", "name: tiny\nphysiology: {ejection_fraction_max: 0.99}\n", END),
    ("name: tiny\n", "name: tiny\nphysiology: {ejection_fraction_min: 0.89}\n", {"truth": 8, **IMAGES}),
])  # fmt: skip
def test_change_runs_again_what_depends_on_it_and_nothing_else(made, old, new, jobs):
    assert CONFIG.count(old) == 1
    assert made.planned(CONFIG.replace(old, new)) == jobs


@pytest.mark.parametrize(("record", "jobs"), [
    ("phantom/*/mid", {"phantom": 1, "rf": 1, "bmode": 2, "tracking": 2, **END}),
    ("rf/*/mid", {"phantom": 1, "rf": 1, "bmode": 2, "tracking": 2, **END}),
    ("truth/*/mid/64", {"truth": 1, "tracking": 1, **END}),
    ("bmode/*/mid/64", {"bmode": 1, "tracking": 1, **END}),
    ("tracking/*/mid/64", {"tracking": 1, **END}),
    ("repository", END),
])  # fmt: skip
def test_record_that_is_lost_is_made_again_with_what_follows_it(made, record, jobs):
    path = next(made.out.glob(f"ledger/{record}.json"))
    aside = path.rename(made.folder / "aside.json")
    try:
        assert made.planned() == jobs
    finally:
        aside.rename(path)


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """Folder whose run on one core was killed during imaging, after mechanics, and then continued."""
    workspace = Workspace(tmp_path_factory.mktemp("second") / "echotruth", CONFIG)
    run = workspace.start(sys.executable, "-m", "snakemake", *PLAIN)
    workspace.kill_when(run, lambda: workspace.has("scratch/*/*/scatterers.npz"))
    before = {path: path.stat().st_mtime_ns for path in workspace.out.glob("ledger/mechanics/*.json")}
    unfinished = len(list(workspace.out.glob("ledger/bmode/*/*/*.json")))
    workspace.echotruth("run", "tiny.yaml", "--cores", "1")
    return workspace, before, unfinished


@pytest.mark.slow
def test_killed_run_taken_up_again_gives_the_bytes_of_an_unbroken_run_on_more_cores(made, killed):
    workspace, _, unfinished = killed
    assert unfinished < 8
    assert differing(made.out, workspace.out) == []


@pytest.mark.slow
def test_killed_run_keeps_the_mechanics_it_had(killed):
    _, before, _ = killed
    assert before
    assert {path: path.stat().st_mtime_ns for path in before} == before


@pytest.mark.slow
def test_run_leaves_the_report_and_all_words_in_logs_and_nothing_in_scratch(killed):
    out = killed[0].out
    assert (out / "report.html").stat().st_size > 10_000
    assert "Job stats" in (out / "logs/snakemake.log").read_text()
    assert (out / "logs/repository.log").read_text().startswith("repository: 2 complete")
    assert not (out / "scratch").exists()


@pytest.mark.slow
def test_repository_whose_probe_was_changed_equals_one_made_with_it(tmp_path):
    text = CONFIG.replace("[1, 2]\n", "[1]\n").replace("frames: 6", "frames: 4")
    changed, fresh = (Workspace(tmp_path / name, text) for name in ("changed", "fresh"))
    changed.echotruth("run", "tiny.yaml", "--cores", "2", "repository")
    for workspace in (changed, fresh):
        workspace.write(text.replace("elements: 16}", "elements: 20}"))
        workspace.echotruth("run", "tiny.yaml", "--cores", "2", "repository")
    assert differing(changed.out, fresh.out) == []

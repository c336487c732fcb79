"""The whole workflow on coarse hearts: results, and what a change or a loss makes again."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from workspace import Workspace

import echotruth as et
from echotruth.workflow.instructions import LEVEL, environment

ROOT = Path(__file__).parents[1]
TRACKERS = ("as_published", "corrected", "wall", "absent")
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
bmode: {size_px: 128, downsampling: [1]}
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
    workspace.echotruth("run", "tiny.yaml", "--cores", "2")
    return workspace


@pytest.fixture(scope="module")
def tree(made):
    with xr.open_datatree(made.out / "tiny.zarr") as opened:
        yield opened


def test_clip_read_at_a_notebook_is_tracked_and_scored_as_the_workflow_does(made, tree):
    folder, case = made.out, str(tree["bmode/128"]["case"].values[0])
    heart, clip = et.Repository(folder).heart(case), et.Repository(folder).clip(case, "long_axis", 128)
    tracked = et.track(clip, "corrected")
    place = {"case": case, "view": "long_axis"}
    np.testing.assert_array_equal(tracked["displacement"], tree["tracking/128/corrected/displacement"].sel(place))
    nrmse = tree["evaluation/128/corrected/scores"].sel(place | {"score": "nrmse_all"})
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
    # No members of packs; and nothing is inferred.
    groups = {path: rows for path, rows in groups.items() if " " not in path and not path.startswith("inference/")}
    paths = {
        path.replace("SIZE", "128").replace("TRACKER", tracker): rows
        for path, rows in groups.items()
        for tracker in TRACKERS
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
    assert (tree["truth/128/labels"].sel(label="layer") > 0).any(("axial", "lateral")).all()
    assert (tree["bmode/128/image"].std(("axial", "lateral")) > 5).all()
    for tracker in ("as_published", "corrected", "wall"):
        assert (tree[f"evaluation/128/{tracker}/scores"].sel(score="coverage") > 0.5).all(), tracker


def test_a_tracker_that_fails_is_a_row_of_the_leaderboard_and_not_the_end_of_the_run(made, tree):
    assert (tree["evaluation/128/absent/scores"].sel(score="coverage") == 0).all()
    for record in (made.out / "ledger/tracking").glob("*/mid/*.json"):
        failures = json.loads(record.read_text())["failures"]
        assert set(failures) == {"absent"} and "cannot be imported" in failures["absent"]
    board = pd.read_csv(made.out / "figures/leaderboard.csv").set_index(["size_px", "view", "tracker"])
    assert board.loc[(128, "all", "absent"), "failures"] == 4
    assert board.loc[(128, "all", "absent"), "nrmse_all_percent"] == pytest.approx(100)
    assert board.loc[(128, "all", "wall"), "rank"] == 1


def test_run_leaves_figures_report_and_all_words_in_logs_and_nothing_in_scratch(made):
    assert {path.suffix for path in (made.out / "figures").iterdir()} == {".png", ".svg", ".gif", ".csv", ".mp4"}
    assert (made.out / "report.html").stat().st_size > 10_000
    assert "Job stats" in (made.out / "logs/snakemake.log").read_text()
    assert (made.out / "logs/repository.log").read_text().startswith("repository: 2 complete")
    assert not (made.out / "scratch").exists()


def test_every_record_names_the_instructions_that_its_job_used(made):
    records = [json.loads(path.read_text()) for path in (made.out / "ledger").rglob("*.json")]
    used = {record["instructions"] for record in records if "stage" in record}
    assert len(used) == 1
    assert used.pop().startswith(LEVEL if environment() else "native ")


def test_second_run_has_nothing_to_do(made):
    assert made.planned() == {}


END = {"repository": 1, "report": 1}
IMAGES = {"phantom": 4, "rf": 4, "bmode": 4, "tracking": 4, **END}
"""Jobs of two hearts with two views."""


# tests/test_growth.py makes what another case, size or tracker needs.
@pytest.mark.parametrize(("old", "new", "jobs"), [
    ("as_published: {window_px: 16}", "as_published: {window_px: 32}", {"tracking": 4, **END}),
    ("    absent: {method: external, track: \"absent:track\"}\n", "", {"tracking": 4, **END}),
    ("  mid: {position: 0.5}\n", "  mid: {position: 0.5}\n  apex: {position: 0.7}\n",
     {"phantom": 2, "rf": 2, "truth": 2, "bmode": 2, "tracking": 2, **END}),
    ("mid: {position: 0.5}", "mid: {position: 0.6}",
     {"phantom": 2, "rf": 2, "truth": 2, "bmode": 2, "tracking": 2, **END}),
    ("elements: 16}", "elements: 20}", IMAGES),
    ("name: tiny\n", "name: tiny\nmechanics: {base: fixed}\n", {"mechanics": 2, "truth": 4, **IMAGES}),
    ("name: tiny\n", "name: tiny\nphysiology: {ejection_fraction_max: 0.99}\n", END),
    ("name: tiny\n", "name: tiny\nphysiology: {ejection_fraction_min: 0.89}\n", {"truth": 4, **IMAGES}),
])  # fmt: skip
def test_change_runs_again_what_depends_on_it_and_nothing_else(made, old, new, jobs):
    assert CONFIG.count(old) == 1
    assert made.planned(CONFIG.replace(old, new)) == jobs


# tests/test_growth.py makes lost tracks again, and the record of the repository.
@pytest.mark.parametrize(("record", "jobs"), [
    ("rf/*/mid", {"phantom": 1, "rf": 1, "bmode": 1, "tracking": 1, **END}),
    ("truth/*/mid/128", {"truth": 1, "tracking": 1, **END}),
    ("bmode/*/mid/128", {"bmode": 1, "tracking": 1, **END}),
])  # fmt: skip
def test_record_that_is_lost_is_made_again_with_what_follows_it(made, record, jobs):
    path = next(made.out.glob(f"ledger/{record}.json"))
    aside = path.rename(made.folder / "aside.json")
    try:
        assert made.planned() == jobs
    finally:
        aside.rename(path)

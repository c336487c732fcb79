"""What is inferred, in the store: of a repository whose jobs are all done, with draws that are known."""

import shutil
from functools import partial

import finished_repository as finished
import numpy as np
import pandas as pd
import pytest
import xarray as xr

from echotruth.cases import expand
from echotruth.config import Inference, Motion, PhaseCorrelation, Tracking
from echotruth.config.loading import ConfigError, validate
from echotruth.report import account
from echotruth.report import inference as drawing
from echotruth.repository import inferred, schema
from echotruth.repository.check import check
from echotruth.repository.publication import publish
from echotruth.repository.reader import Repository
from echotruth.repository.version import version_of
from echotruth.workflow.job import Job

configured = partial(finished.configured, views=("mid",), motion=Motion())
CONFIG = configured(inference=Inference(tracker="one"))
CASES = [case.id for case in expand(CONFIG)]
SEEN = schema.observations(CONFIG)


def result(job):
    arrays = finished.blank(job)
    if job.stage == "inference":
        row = CASES.index(job.case.id)
        names = schema.LABELS["parameter"]
        places = {name: place for place, name in enumerate(names)}
        draws = np.random.default_rng(row).normal(1, 0.1, (1, schema.DRAWS, len(names)))
        draws[..., places["fibres.endo_deg"]] = np.nan  # is not inferred if fibres are read from a file
        scar = np.zeros((1, schema.DRAWS, 17))
        scar[:, : schema.DRAWS // 2, 7] = 1
        arrays["inference/posterior"] = {"value": draws, "scar": scar}
        arrays["inference/fit"] |= {
            "mean": draws.mean((0, 1)),
            "scar_probability": scar.mean((0, 1)),
            "identifiable": np.arange(len(names)) % 2,
            "misfit_probability": np.array([0.5, 0.001][row % 2]),
            "converged": np.array(1.0),
        }
        seen = np.full(len(SEEN), np.nan)
        seen[SEEN.index("mid 7")] = -0.12
        arrays["inference/observed_data"] = {"value": seen}
    return arrays


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return finished.finish(tmp_path_factory.mktemp("done") / "small", CONFIG, result)


def test_xarray_opens_the_groups_of_inference_data(folder):
    tree = xr.open_datatree(folder / f"small.zarr/inference/{CASES[1]}", engine="zarr")
    assert {*tree.children} == {
        *("posterior", "prior", "observed_data", "posterior_predictive", "constant_data", "fit"),
    }
    posterior = tree["posterior"].to_dataset()
    assert posterior["value"].dims == ("chain", "draw", "parameter") and posterior.sizes["draw"] == schema.DRAWS
    due = np.random.default_rng(1).normal(1, 0.1, (1, schema.DRAWS, posterior.sizes["parameter"]))[0, :, 2]
    np.testing.assert_allclose(posterior["value"].isel(chain=0).sel(parameter="contractility.3"), due, rtol=1e-6)
    assert posterior["parameter_units"].sel(parameter="loop.esp_mmHg").item() == "mmHg"
    seen = tree["observed_data"].to_dataset()["value"]
    assert seen.sel(observation="mid 7").item() == -0.12 and int(seen.notnull().sum()) == 1


def test_damage_to_what_was_inferred_is_found(folder, tmp_path):
    assert [fault for fault in check(folder).faults if "inference" in str(fault)] == []
    copy = shutil.copytree(folder, tmp_path / "small")
    shards = (copy / f"small.zarr/inference/{CASES[0]}/posterior/value/c").rglob("*")
    next(path for path in shards if path.is_file()).unlink()
    found = [str(fault) for fault in check(copy).faults if "inference" in str(fault)]
    assert found and all(f"delete small.zarr/inference/{CASES[0]} and run" in fault for fault in found)


def test_version_is_that_of_the_section_and_of_all_that_was_tracked():
    trackers = {name: PhaseCorrelation(window_px=16) for name in ("one", "two")}
    others = [
        configured(tracking=Tracking(trackers=trackers), inference=Inference(tracker="two")),
        configured(views=("mid", "long_axis"), inference=Inference(tracker="one")),
        configured(inference=Inference(tracker="one", size_px=finished.SIZE)),
        configured(inference=Inference(tracker="one", prior={"fibres.endo_deg": [75, 3]})),
        configured(inference=Inference(tracker="one", prior={"fibres.endo_deg": None})),
    ]
    hashes = [version_of("inference", config) for config in (CONFIG, *others)]
    assert len(set(hashes)) == len(hashes)
    two = CONFIG.tracking.model_copy(update={"trackers": CONFIG.tracking.trackers | {"two": trackers["two"]}})
    further = CONFIG.model_copy(update={"tracking": two})
    assert version_of("inference", further) == hashes[0], "what another tracker finds is not read"
    assert len({version_of("mechanics", config) for config in (CONFIG, *others)}) == 1


def test_table_has_a_row_for_each_heart_and_parameter_that_was_inferred(folder):
    table = inferred.table(Repository(folder))
    assert list(table.columns) == list(inferred.COLUMNS)
    assert list(table["case"].unique()) == CASES and set(table["tracker"]) == {"one"}
    assert len(table) == len(CASES) * (len(schema.LABELS["parameter"]) - 1)
    rows = table[table["case"] == CASES[0]].set_index("parameter")
    assert (
        rows.loc["contractility.8", "scar_probability"] == 0.5 and rows.loc["contractility.7", "scar_probability"] == 0
    )
    assert np.isnan(rows.loc["stiffness.8", "scar_probability"])
    assert rows.loc["loop.edv_uL", "unit"] == "uL" and rows.loc["contractility.1", "unit"] == "1"
    assert list(table.groupby("case", sort=False)["misfit"].first()) == [False, True]


def test_without_a_tracker_nothing_is_inferred(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "small")
    without = configured()
    assert finished.remake(copy, without) == ["repository"] and inferred.table(Repository(copy)).empty


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"inference": {"tracker": "dos"}}, "inference.tracker = 'dos': use one of"),
        (
            {"inference": {"tracker": "dis", "size_px": 100}},
            "inference.size_px = 100: is no image size: use one of 512",
        ),
        ({"inference": {"size_px": 512}}, "inference.size_px = 512: needs inference.tracker"),
        ({"inference": {"errors": "a.csv"}}, "inference.errors = 'a.csv': needs inference.tracker"),
        ({"inference": {"prior": {"fibres.endo_deg": None}}}, "inference.prior = .*: needs inference.tracker"),
        (
            {"inference": {"tracker": "dis", "prior": {"fibres.endo_deg": [75]}}},
            "endo_deg = .*: should have at least 2 items",
        ),
        ({"inference": {"tracker": "dis"}, "motion": {"kind": "rigid"}}, "motion.kind = rigid has not"),
        ({"cases": {"inference.tracker": ["dis", "bspline_dic"]}}, "inference.tracker"),
    ],
)
def test_settings_that_cannot_be_inferred_from_are_refused_in_a_sentence(given, said):
    with pytest.raises(ConfigError, match=said):
        expand(validate({"tracking": {"trackers": {"dis": {"method": "dis"}}}} | given, "a.yaml"), "a.yaml")


def test_heart_of_which_nothing_can_be_inferred_is_told_and_the_others_stay(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "small")
    job = Job(copy, "inference", CASES[0])
    finished.do(job, finished.solved)  # the error of this tracker is not known
    publish(copy, CONFIG, expand(CONFIG))
    repository = Repository(copy)
    found = repository.attributes("inference", CASES[0])
    assert found["status"] == "failed" and found["reason"].startswith("tracker: the error of one at 64 px")
    assert inferred.hearts(repository) == CASES[1:]
    assert [fault for fault in check(copy).faults if "inference" in str(fault)] == []
    told = account.inference(repository, inferred.table(repository))
    assert [one["case"] for one in told["failed"]] == CASES[:1] and [one["case"] for one in told["hearts"]] == CASES[1:]
    assert told["hearts"][0]["misfit"] and told["case"] == CASES[1]


def test_table_of_a_repository_of_which_nothing_was_inferred_is_read_and_shown_as_none(folder, tmp_path):
    repository, path = Repository(folder), tmp_path / inferred.FILE
    inferred.write(path, pd.DataFrame(columns=list(inferred.COLUMNS)))
    found = inferred.read(path)
    assert found.empty and inferred.shown(repository, found) == ""
    assert account.inference(repository, found)["hearts"] == []


def test_table_is_read_as_it_was_written(folder, tmp_path):
    table = inferred.table(Repository(folder)).assign(case="007")  # a name of digits is none of a number
    inferred.write(tmp_path / inferred.FILE, table)
    read = inferred.read(tmp_path / inferred.FILE)
    assert list(read["case"].unique()) == ["007"] and read["misfit"].dtype == bool
    np.testing.assert_allclose(read["mean"], table["mean"], rtol=1e-5)
    np.testing.assert_array_equal(read["scar_probability"].isna(), table["scar_probability"].isna())


def test_figure_has_the_inferred_numbers_and_hatches_what_is_not_identifiable(folder):
    repository = Repository(folder)
    fit = repository.arrays("inference/fit", CASES[0])
    seen = repository.arrays("inference/observed_data", CASES[0])["value"]
    given = drawing.Seen(SEEN, seen, np.eye(len(SEEN)) * 1e-4, seen, seen)
    figure = drawing.draw(fit, given)
    discs = [axes for part in figure.subfigs for axes in part.axes if axes.get_title()]
    texts = [{text.get_text() for text in axes.texts} for axes in discs]
    names = list(schema.LABELS["parameter"])
    known = [number for number in range(1, 18) if fit["identifiable"][names.index(f"contractility.{number}")]]
    assert len(known) == 8 and sum(patch.get_hatch() is not None for patch in discs[0].patches) == 17 - len(known)
    assert f"{fit['mean'][names.index('contractility.2')]:.2f}" in texts[0] and "0.50" in texts[2]

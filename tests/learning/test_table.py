"""The table of cases says of each heart what its files say."""

import numpy as np
import pytest
import zarr
from finished_repository import begin, blank, configured, finish

import echotruth as et
from echotruth import learning
from echotruth.learning.measurements import PHYSIOLOGY
from echotruth.workflow.failure import CaseFailed

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table(repository):
    return learning.cases(repository)


def test_every_case_has_a_row_with_its_status_and_diagnosis(table):
    assert (table["status"] == "complete").all()
    assert table["diagnosis"].tolist().count("infarct") == table["diagnosis"].tolist().count("healthy") == 2
    assert (table["diagnosis"] == "infarct").equals(table.index.to_series().str.contains("7"))


def test_hearts_that_differ_in_speckle_alone_are_one_heart(table):
    assert table.groupby("heart")["seed"].apply(sorted).tolist() == [[1, 2], [1, 2]]
    assert table.groupby("heart")["diagnosis"].nunique().eq(1).all()


def test_scar_of_two_mid_segments_is_a_sixth_to_a_twelfth_of_the_wall(table):
    """Two of six segments of one of three levels are 1/9 of a wall of even thickness without apical cap."""
    scars = table.set_index("diagnosis")["scar_size"]
    assert (scars["healthy"] == 0).all()
    assert ((scars["infarct"] > 1 / 12) & (scars["infarct"] < 1 / 6)).all()


def test_measurements_are_the_stored_ones_of_each_heart(repository, table):
    for case, row in table.iterrows():
        stored = zarr.open_group(repository / f"small.zarr/hearts/{row['heart']}/physiology", mode="r")
        assert np.array_equal([row[name] for name in PHYSIOLOGY], [stored[name][()] for name in PHYSIOLOGY], True), case


def test_heart_without_a_solution_has_no_measurements_and_no_items(tmp_path):
    config = configured(views=("mid",), cases={"fibres.endo_deg": [60.0, 70.0]})

    def result(job):
        if job.config.fibres.endo_deg == 70:
            raise CaseFailed("the pressure is too high")
        return blank(job)

    table = learning.cases(finish(tmp_path, config, result))
    assert table["status"].tolist() == ["complete", "failed"] and table["reason"].iloc[1] == "the pressure is too high"
    assert np.isfinite(table["gls"].iloc[0]) and table[[*PHYSIOLOGY, "scar_size"]].iloc[1].isna().all()
    assert learning.Clips(tmp_path).places == [(table.index[0], "mid")]
    with pytest.raises(ValueError, match=f"{table.index[1]} has no bmode/64 in the view mid: finish the run"):
        learning.Clips(tmp_path, table.index)


def test_cases_of_one_heart_are_judged_each_by_its_own_bounds(tmp_path):
    def result(job):
        groups = blank(job)
        job.notes["bounded"] = {"volume_ratio_min": 0.5}
        return groups

    finish(tmp_path, configured(views=("mid",), cases={"physiology.volume_ratio_min": [0.4, 0.6]}), result)
    table = et.Repository(tmp_path).cases
    assert table["status"].tolist() == ["complete", "implausible"] and table["heart"].nunique() == 1


def test_cases_of_a_run_that_has_begun_are_unfinished(tmp_path):
    begin(tmp_path, configured())
    table = learning.cases(tmp_path, "seed < 3")
    assert (table["status"] == "unfinished").all() and table["gls"].isna().all() and len(table) == 2
    with pytest.raises(ValueError, match="no case is complete: finish the run"):
        learning.FlowPairs(tmp_path)

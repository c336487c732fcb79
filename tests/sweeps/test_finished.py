"""A repository of hearts from a table is whole without the table: it is read, checked, merged and continued."""

import shutil
from pathlib import Path

import finished_repository as finished
import numpy as np
import pandas as pd
import pytest
import yaml

import echotruth as et
from echotruth.cases import all_cases, expand
from echotruth.config import Config
from echotruth.config.loading import load, validate
from echotruth.repository.case_file import read_case
from echotruth.repository.check import check
from echotruth.repository.layout import lay_out
from echotruth.workflow.merging import merge_repositories

pytestmark = pytest.mark.slow

TABLE = """\
case,fibres.endo_deg,pathology.infarct.segments,label.group,label.age_weeks,note
m1,60,"[7, 8]",sham,12,"first, of ""two"" hearts"
m2,72.5,,MI,,"zwei
kürzere"
,,,,14,
"""


def configured(folder: Path, name: str, table: str = TABLE, **cases):
    file = folder / f"{name}.csv"
    file.write_text(table)
    values = finished.configured(name, cases={}).model_dump(mode="json")
    config = validate(values | {"cases": {"file": str(file), **cases}}, name)
    file.unlink()
    return config


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A repository whose table is gone."""
    folder = tmp_path_factory.mktemp("out")
    config = configured(folder, "small")
    assert finished.finish(folder / "small", config) == folder / "small"
    return folder / "small"


def test_table_of_cases_has_labels_notes_and_diagnosis(made):
    frame = et.Repository(made).tree["cases"].to_dataset().to_dataframe()
    assert list(frame.index) == ["m1", "m2", expand(Config())[0].id]
    assert list(frame["label.group"]) == ["sham", "MI", ""]
    np.testing.assert_array_equal(frame["label.age_weeks"], [12, np.nan, 14])
    assert list(frame["note"]) == ['first, of "two" hearts', "zwei\nkürzere", ""]
    assert list(frame["diagnosis"]) == ["infarct", "healthy", "healthy"]


def test_table_of_cases_as_a_file_is_read_back_the_same(made):
    frame = pd.read_csv(made / "cases.csv", keep_default_na=False)
    assert list(frame["note"]) == ['first, of "two" hearts', "zwei\nkürzere", ""]
    assert list(frame["diagnosis"]) == ["infarct", "healthy", "healthy"]


def test_repository_is_read_and_checked_without_its_table(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert et.Repository(made).heart("m2").config.fibres.endo_deg == 72.5
    assert et.Repository(made).heart("m1").config.pathology.infarct.segments == [7, 8]
    report = check(made)
    assert report.faults == [] and report.notes == []


def test_configuration_of_the_repository_has_the_lines_of_the_table(made):
    text = (made / "config.yaml").read_text()
    assert "  table: |" in text and '    m1,60,"[7, 8]",sham,12' in text
    assert yaml.safe_load(text)["cases"]["table"] == TABLE


def test_jobs_read_their_heart_without_the_table(made):
    cases = all_cases(load(made / "config.yaml"))
    assert {id: read_case(made, id).config for id in cases} == {id: case.config for id, case in cases.items()}
    assert "table" not in (made / "cases/m1.json").read_text()


def test_rows_that_are_added_leave_what_was_made(made, tmp_path):
    folder = Path(shutil.copytree(made, tmp_path / "small"))
    before, owners = finished.content(folder), finished.owners(folder)
    new = "m0,61,,MI,9,\n"
    head, rest = TABLE.split("\n", 1)
    config = configured(tmp_path, "small", f"{head}\n{new}{rest}")
    lay_out(folder, config, expand(config))
    after = finished.content(folder)
    shards = [name for name in before if not owners[name].endswith("structure.json")]
    assert shards and {name: after[name] for name in shards} == {name: before[name] for name in shards}
    report = check(folder)
    assert report.faults == [] and "have not been run yet" in report.notes[0]
    assert (folder / "registry.txt").read_text().split()[-1] == "m0"


def test_repositories_of_tables_are_merged_under_the_ids_of_their_hearts(made, tmp_path, capsys):
    other = configured(tmp_path, "other", TABLE.replace("m1,60", "m9,61"))
    finished.finish(tmp_path / "other", other)
    first = Path(shutil.copytree(made, tmp_path / "small"))
    assert merge_repositories(tmp_path / "both", [first, tmp_path / "other"]) == 0, capsys.readouterr().err
    report = check(tmp_path / "both")
    assert report.faults == [] and report.notes == []
    frame = et.Repository(tmp_path / "both").tree["cases"].to_dataset().to_dataframe()
    assert {"m1", "m2", "m9"} < set(frame.index) and len(frame) == 4
    assert list(frame["label.group"]) == ["sham", "MI", "", "sham"]


def test_one_id_for_two_hearts_is_not_merged(made, tmp_path, capsys):
    other = configured(tmp_path, "other", TABLE.replace("m1,60", "m1,61"))
    finished.finish(tmp_path / "other", other)
    assert merge_repositories(tmp_path / "both", [made, tmp_path / "other"]) == 2
    assert "m1 is another heart than that of the same id" in capsys.readouterr().err
    assert not (tmp_path / "both").exists()


def test_draws_and_conditions_are_merged_as_the_hearts_that_they_gave(tmp_path, capsys):
    draw = {"number": 4, "keys": {"fibres.epi_deg": {"uniform": [-46, -38]}}}
    values = finished.configured("one", cases={}).model_dump(mode="json")
    one = validate(values | {"cases": {"draw": draw, "where": "fibres.epi_deg < -39"}}, "one")
    two = finished.configured("two", seeds=(1, 2))
    for config in (one, two):
        finished.finish(tmp_path / config.name, config)
    assert merge_repositories(tmp_path / "both", [tmp_path / "one", tmp_path / "two"]) == 0, capsys.readouterr().err
    assert check(tmp_path / "both").faults == []
    assert set(all_cases(load(tmp_path / "both/config.yaml"))) == {*all_cases(one), *all_cases(two)}

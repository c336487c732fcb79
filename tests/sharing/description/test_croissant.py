"""Croissant of a repository: its reference reader finds no fault, and reads what is in the files."""

import json
import os
from hashlib import sha256

import numpy as np
import pandas as pd
import pytest
import zarr

import echotruth as et

mlcroissant = pytest.importorskip("mlcroissant")
pytestmark = pytest.mark.slow

NEURIPS = {
    *("rai:dataLimitations", "rai:dataBiases", "rai:personalSensitiveInformation", "rai:dataUseCases"),
    *("rai:dataSocialImpact", "rai:hasSyntheticData", "prov:wasDerivedFrom", "prov:wasGeneratedBy"),
}
"""The least that the Evaluations and Datasets Track of 2026 asks for beyond the core."""
CORE = {"name", "description", "license", "url", "creator", "datePublished", "conformsTo", "distribution", "recordSet"}


def read(folder):
    return json.loads((folder / "croissant.json").read_text())


@pytest.fixture(scope="module")
def dataset(described):
    return mlcroissant.Dataset(jsonld=os.fspath(described / "croissant.json"))


def records(dataset, name):
    return [{key.partition("/")[2]: value for key, value in record.items()} for record in dataset.records(name)]


def text(value):
    return value.decode() if isinstance(value, bytes) else value


def test_reference_reader_finds_neither_error_nor_warning(dataset):
    issues = dataset.metadata.ctx.issues
    assert not issues.errors and not issues.warnings


def test_reference_reader_finds_no_fault_in_what_failed_and_is_unlicensed(failed):
    dataset = mlcroissant.Dataset(jsonld=os.fspath(failed / "croissant.json"))
    assert not dataset.metadata.ctx.issues.errors and not dataset.metadata.ctx.issues.warnings
    assert all(next(iter(dataset.records(one.id))) for one in dataset.metadata.record_sets)


def test_records_of_cases_are_the_rows_of_the_table(dataset, described):
    table = pd.read_csv(described / "cases.csv")
    found = pd.DataFrame([{key: text(value) for key, value in record.items()} for record in records(dataset, "cases")])
    for name in ("case", "seed", "fibres.endo_deg", "phantom.in_plane_only", "motion.kind"):
        assert list(found[name]) == list(table[name]), name


def test_records_of_clips_find_their_pixels_in_the_store(dataset, described):
    repository, clips = et.Repository(described), records(dataset, "clips")
    assert len(clips) == 2 * 2
    for one in clips:
        found = zarr.open_array(repository.store, path=text(one["array"]), mode="r")[...]
        ours = repository.arrays(f"bmode/{one['size_px']}", text(one["case"]), text(one["view"]), "image")["image"]
        assert len(found) == one["frames"] and np.array_equal(found, ours)


def test_files_have_the_checksums_that_are_told(described):
    files = [one for one in read(described)["distribution"] if one["@type"] == "cr:FileObject"]
    assert {one["@id"] for one in files} == {"cases.csv", "clips.csv"}
    for one in files:
        assert sha256((described / one["contentUrl"]).read_bytes()).hexdigest() == one["sha256"], one["@id"]


def test_what_neurips_asks_for_is_there(described):
    document = read(described)
    assert all(document[key] for key in NEURIPS | CORE)
    assert document["rai:hasSyntheticData"] is True
    assert document["rai:personalSensitiveInformation"].startswith("None")
    assert any("Diagnosis" in limit for limit in document["rai:dataLimitations"])

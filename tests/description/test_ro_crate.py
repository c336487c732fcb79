"""RO-Crate of a repository: a validator of the profile is silent, and it says of the run what the ledger does."""

import json
from datetime import datetime
from hashlib import sha256
from pathlib import Path

import pytest
from described_repository import BEGIN, END

pytest.importorskip("mlcroissant")
pytest.importorskip("rocrate")

CONTEXT = Path(__file__).parent / "ro-crate-1.1-context.jsonld"
"""Copy of https://w3id.org/ro/crate/1.1/context (CC0), so that no test needs the web."""
UNSATISFIABLE = {"The SoftwareApplication id SHOULD be an absolute URI"}
"""Recommended, but a workflow in the crate is a file, whose name is relative."""


def entities(folder):
    return {one["@id"]: one for one in json.loads((folder / "ro-crate-metadata.json").read_text())["@graph"]}


def references(value):
    if isinstance(value, list):
        return [found for item in value for found in references(item)]
    return [value["@id"]] if isinstance(value, dict) else []


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """Cache of the validator that has the context."""
    pytest.importorskip("rocrate_validator")
    from requests import Request
    from requests_cache import CachedResponse, CachedSession

    path = tmp_path_factory.mktemp("cache") / "cache"
    address, session = "https://w3id.org/ro/crate/1.1/context", CachedSession(str(path), backend="sqlite")
    headers = {"Content-Type": "application/ld+json"}
    response = CachedResponse(url=address, status_code=200, content=CONTEXT.read_bytes(), headers=headers)
    session.cache.save_response(response, session.cache.create_key(Request("GET", address).prepare()))
    session.close()
    return path


def issues(folder, severity, cache):
    """What the validator says of a crate, without the web."""
    from rocrate_validator import models, services

    settings = {"profile_identifier": "workflow-run-crate", "offline": True, "cache_path": cache}
    result = services.validate(
        services.ValidationSettings(rocrate_uri=str(folder), requirement_severity=severity, **settings)
    )
    assert isinstance(result, models.ValidationResult)
    return {issue.message for issue in result.get_issues()}


def test_validator_finds_all_that_is_required(described, cache):
    assert not issues(described, "REQUIRED", cache)


def test_validator_finds_all_that_is_recommended_and_possible(described, cache):
    assert issues(described, "RECOMMENDED", cache) <= UNSATISFIABLE


def test_validator_finds_what_is_required_where_little_is_known(unfinished, cache):
    assert not issues(unfinished, "REQUIRED", cache)


def test_validator_is_not_silent_about_a_fault(described, cache, tmp_path):
    graph = json.loads((described / "ro-crate-metadata.json").read_text())
    for one in graph["@graph"]:
        one.pop("mainEntity", None)
    (tmp_path / "ro-crate-metadata.json").write_text(json.dumps(graph))
    assert issues(tmp_path, "REQUIRED", cache)


def test_files_exist_with_the_checksums_that_are_told(described):
    files = [one for one in entities(described).values() if "File" in one["@type"]]
    assert len(files) > 10
    for one in files:
        content = (described / one["@id"]).read_bytes()
        assert (sha256(content).hexdigest(), str(len(content))) == (one["sha256"], one["contentSize"]), one["@id"]


def test_all_that_is_referred_to_is_described(described):
    known = entities(described)
    outside = {"https://w3id.org/ro/crate/1.1", "https://doi.org/10.1093/bioinformatics/bts480"}
    named = {found for one in known.values() for value in one.values() for found in references(value)}
    assert {name for name in named - known.keys() - outside if not name.startswith("https://snakemake")} == set()


def test_run_has_the_times_of_its_records(described):
    run = entities(described)["#run"]
    first, last = (datetime.fromisoformat(run[name]).timestamp() for name in ("startTime", "endTime"))
    assert BEGIN - 60 < first <= BEGIN  # the job of the first record took some time
    assert last == END


def test_workflow_is_what_ran_on_the_configuration_and_gave_the_store(described):
    known = entities(described)
    run, workflow = known["#run"], known[known["./"]["mainEntity"]["@id"]]
    assert run["instrument"]["@id"] == workflow["@id"] == "workflow/Snakefile"
    assert (run["object"]["@id"], run["result"]["@id"]) == ("config.yaml", "small.zarr/")
    assert known["#input-configuration"]["workExample"]["@id"] == "config.yaml"
    package = next(one for one in known.values() if one.get("name") == "numpy")
    root = json.loads((described / "small.zarr/zarr.json").read_text())["attributes"]
    assert package["softwareVersion"] == root["packages"]["numpy"]


def test_a_run_that_has_not_ended_has_no_status(described, unfinished):
    assert entities(described)["#run"]["actionStatus"].endswith("CompletedActionStatus")
    assert "actionStatus" not in entities(unfinished)["#run"]

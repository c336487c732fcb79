"""Records that the workflow asks for: the last ones, and those that nothing else would make again."""

import itertools

import pytest

from echotruth.repository.ledger import GATES, VIEW_STAGES, commit, record_path
from echotruth.workflow.requests import ORDER, requested_records

CASES, VIEWS = ("heart", "seed2_b105c5"), ("apex", "mid")
LAST = {("evaluation", case, view) for case in CASES for view in VIEWS}


def all_records():
    gates = [(stage, case, None) for stage in GATES for case in CASES]
    return gates + [(stage, case, view) for stage in VIEW_STAGES for case in CASES for view in VIEWS]


def asked(folder):
    paths = {record_path(folder, *record): record for record in all_records()}
    requested = requested_records(folder, CASES, VIEWS)
    assert len(requested) == len(set(requested))
    return {paths[path] for path in requested}


def write(folder, records):
    for record in records:
        commit(record_path(folder, *record), {})


def test_last_records_are_asked_for_whether_anything_is_made_or_not(tmp_path):
    assert asked(tmp_path) == LAST
    write(tmp_path, all_records())
    assert asked(tmp_path) == LAST


@pytest.mark.parametrize("lost", [record for record in all_records() if record[1] == "heart" and record[2] != "mid"])
def test_any_record_lost_from_a_finished_sweep_is_asked_for(tmp_path, lost):
    write(tmp_path, [record for record in all_records() if record != lost])
    assert asked(tmp_path) == LAST | {lost}


def test_what_has_not_been_made_yet_is_not_asked_for(tmp_path):
    """Jobs make it on the way to the last records."""
    for number in range(len(ORDER)):
        write(tmp_path, [record for record in all_records() if record[0] == ORDER[number]])
        assert asked(tmp_path) == LAST


def test_drafts_are_no_records(tmp_path):
    write(tmp_path, all_records())
    for stage, view in itertools.product(("rf", "bmode"), VIEWS):
        path = record_path(tmp_path, stage, "heart", view)
        path.rename(path.with_name(f".{path.name}.draft"))
    assert asked(tmp_path) == LAST | {(stage, "heart", view) for stage in ("rf", "bmode") for view in VIEWS}

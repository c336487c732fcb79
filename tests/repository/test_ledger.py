"""Records are complete or absent, and rows never change."""

import json
import os

import pytest

from echotruth.repository import ledger


def test_record_reads_back(tmp_path):
    record = {"stage": "rf", "view": None, "sha256": {"a": "b"}}
    ledger.commit(tmp_path / "rf/heart/mid.json", record)
    assert ledger.read(tmp_path / "rf/heart/mid.json") == record
    assert [path.name for path in (tmp_path / "rf/heart").iterdir()] == ["mid.json"]


def test_record_that_cannot_be_written_leaves_no_file_under_its_name(tmp_path):
    with pytest.raises(TypeError):
        ledger.commit(tmp_path / "mid.json", {"first": 1, "second": object()})
    assert not (tmp_path / "mid.json").exists()


def test_record_takes_its_name_whole_and_after_it_is_on_disk(tmp_path, monkeypatch):
    path, events = tmp_path / "mid.json", []
    replace = type(path).replace

    def synced(_):
        events.append("on disk")
        assert not path.exists()

    def named(draft, target):
        events.append("named")
        assert json.loads(draft.read_text()) == {"stage": "rf"}
        return replace(draft, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(type(path), "replace", named)
    ledger.commit(path, {"stage": "rf"})
    assert events == ["on disk", "named"]


def test_failed_commit_leaves_the_earlier_record(tmp_path, monkeypatch):
    path = tmp_path / "mid.json"
    ledger.commit(path, {"run": 1})

    def full(_):
        raise OSError("no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError):
        ledger.commit(path, {"run": 2})
    assert ledger.read(path) == {"run": 1}


def test_register_never_moves_a_row(tmp_path):
    registry = tmp_path / "registry.txt"
    assert ledger.register(registry, ["b", "c"]) == {"b": 0, "c": 1}
    assert ledger.register(registry, ["a", "c"]) == {"b": 0, "c": 1, "a": 2}
    assert ledger.register(registry, ["d"]) == {"b": 0, "c": 1, "a": 2, "d": 3}
    assert registry.read_text() == "b\nc\na\nd\n"


def test_rows_of_a_repository_not_yet_made_are_none(tmp_path):
    assert ledger.rows(tmp_path / "registry.txt") == {}

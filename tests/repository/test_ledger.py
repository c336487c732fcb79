"""Records are complete or absent, and rows never change."""

import json
import os
import subprocess
import sys

import pytest

from echotruth.repository import ledger


def test_record_reads_back(tmp_path):
    record = {"stage": "rf", "view": None, "sha256": {"a": "b"}}
    ledger.commit(tmp_path / "rf/heart/mid.json", record)
    assert ledger.read(tmp_path / "rf/heart/mid.json") == record
    assert [path.name for path in (tmp_path / "rf/heart").iterdir()] == ["mid.json"]


@pytest.mark.parametrize("key", ["sha256", "files"])
@pytest.mark.parametrize("name", ["/etc/passwd", "../../mine", "bmode/../../../mine"])
def test_record_that_vouches_for_a_file_outside_is_not_read(tmp_path, key, name):
    ledger.commit(tmp_path / "mid.json", {key: {"bmode/64/image/c/0": "0" * 64, name: "0" * 64}})
    with pytest.raises(json.JSONDecodeError, match="it names a file outside of the repository"):
        ledger.read(tmp_path / "mid.json")


@pytest.mark.parametrize("measures", [None, [1, 2], {"gls_max": "high"}])
def test_record_whose_measures_are_no_numbers_is_not_read(tmp_path, measures):
    ledger.commit(tmp_path / "heart.json", {"bounded": measures})
    with pytest.raises(json.JSONDecodeError, match="its entry bounded does not hold numbers"):
        ledger.read(tmp_path / "heart.json")


@pytest.mark.parametrize("text", ["null", "[1, 2]", "1e999", '"sha256"'])
def test_text_that_is_no_record_is_not_read(text):
    with pytest.raises(json.JSONDecodeError, match="it is not a record"):
        ledger.parse(text)


def test_record_of_many_levels_is_not_read(tmp_path):
    (tmp_path / "mid.json").write_text('{"a":' * 100_000 + "1" + "}" * 100_000)
    with pytest.raises(json.JSONDecodeError, match="it is nested too deeply"):
        ledger.read(tmp_path / "mid.json")


def test_pipe_in_place_of_a_record_or_registry_is_not_waited_for(tmp_path):
    for name in ("mid.json", "registry.txt"):
        os.mkfifo(tmp_path / name)
    with pytest.raises(json.JSONDecodeError, match="it is not a file"):
        ledger.read(tmp_path / "mid.json")
    assert ledger.rows(tmp_path / "registry.txt") == {}


def test_record_that_cannot_be_written_leaves_no_file_under_its_name(tmp_path):
    with pytest.raises(TypeError):
        ledger.commit(tmp_path / "mid.json", {"first": 1, "second": object()})
    assert not (tmp_path / "mid.json").exists()


def test_record_takes_its_name_whole_and_after_it_is_on_disk(tmp_path, monkeypatch):
    path, events = tmp_path / "mid.json", []
    replace = type(path).replace

    def synced(_):
        events.append("name on disk" if path.exists() else "on disk")

    def named(draft, target):
        events.append("named")
        assert ledger.read(draft) == {"stage": "rf"}
        return replace(draft, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(type(path), "replace", named)
    ledger.commit(path, {"stage": "rf"})
    assert events == ["on disk", "named", "name on disk"]


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


REGISTER = """
import sys
from pathlib import Path
from echotruth.repository.ledger import register
print("ready", flush=True)
sys.stdin.readline()
for number in range(60):
    register(Path(sys.argv[1]), [f"common{number}", f"{sys.argv[2]}{number}"])
"""


def test_processes_that_register_at_once_lose_no_row(tmp_path):
    registry = tmp_path / "registry.txt"
    start = [sys.executable, "-c", REGISTER, str(registry)]
    names = ("a", "b", "c")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    processes = [subprocess.Popen([*start, name], **pipes) for name in names]
    assert [process.stdout.readline() for process in processes] == ["ready\n"] * 3
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    assert [process.communicate()[0] for process in processes] == [""] * 3
    lines = registry.read_text().splitlines()
    assert sorted(lines) == sorted(f"{name}{number}" for name in (*names, "common") for number in range(60))
    for name in names:  # in the order in which each registered them
        assert [line for line in lines if line[0] == name and line[1].isdigit()] == [f"{name}{k}" for k in range(60)]


def test_draft_of_a_killed_process_is_not_taken_for_a_record(tmp_path):
    path = tmp_path / "registry.txt"
    ledger.register(path, ["a"])
    (tmp_path / ".registry.txt.other.1.0.partial").write_text("half")
    assert ledger.register(path, ["b"]) == {"a": 0, "b": 1}


def test_registering_what_is_known_leaves_the_file_untouched(tmp_path):
    path = tmp_path / "views.txt"
    ledger.register(path, ["mid", "apex"])
    before = path.stat()
    ledger.register(path, ["apex", "mid"])
    assert (path.stat().st_mtime_ns, path.stat().st_ino) == (before.st_mtime_ns, before.st_ino)


@pytest.mark.parametrize(
    "content",
    [None, b"", b"mid\n", b"mad\nbase\n", b"mid\nbase\ntop\n", b"mie\nbase\ntop\n", b"mid\nmid\n", b"m\xe9d\n"],
)
def test_lost_or_damaged_registry_is_made_again_from_the_store(tmp_path, content):
    path = tmp_path / "views.txt"
    if content is not None:
        path.write_bytes(content)
    known = ["mid", "base", *(["top"] if content and b"top" in content else [])]
    expected = {name: row for row, name in enumerate([*known, "apex"])}
    assert ledger.register(path, ["apex", "mid"], stored=["mid", "base"]) == expected
    assert path.read_text().split() == list(expected)


def test_rows_of_a_repository_not_yet_made_are_none(tmp_path):
    assert ledger.rows(tmp_path / "registry.txt") == {}


def test_repository_of_an_empty_configuration_is_not_read_as_one_of_defaults(tmp_path):
    ledger.register(tmp_path / "registry.txt", ["a"])
    (tmp_path / "config.yaml").touch()
    with pytest.raises(FileNotFoundError, match=r"config.yaml: is empty: run the repository again"):
        ledger.repository_folder(tmp_path)


def test_every_flipped_bit_of_a_record_is_found_or_changes_nothing(tmp_path):
    """In the name of the seal too, without which a record would be taken as it is."""
    record = {"stage": "rf", "code": "0123456789abcdef", "sha256": {"rf/lines/c/0": "ab"}}
    ledger.commit(tmp_path / "one.json", record)
    whole, accepted = (tmp_path / "one.json").read_bytes(), []
    for place in range(len(whole)):
        for bit in range(8):
            damaged = whole[:place] + bytes([whole[place] ^ 1 << bit]) + whole[place + 1 :]
            try:
                accepted.append(ledger.parse(damaged.decode()))
            except ValueError:
                continue
    assert all(found == record for found in accepted)

"""A repository whose files were damaged, exchanged, planted or forged: the one that ships, with a report.

Damage must be named by `echotruth check`, and what is forged, with checksums that were made to fit, at least make no
command touch a file outside of the folder. What nothing reads may stay; `echotruth info` and `status` say a sentence.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import zipfile
from collections.abc import Callable, Iterator
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from hostile_child import ACCEPTED, EXECUTED, FOUND, OUTSIDE, REFUSED, SILENT, UNCLEAR, Answer, Child, Trial
from hostile_pickles import pickled

from echotruth.config import shipped
from echotruth.repository import ledger
from echotruth.repository.checksums import commit_beside

PART = "repository"
STORE, CASE, VIEW, SIZE = "sample.zarr", "healthy", "mid", "256"
SHARDS, DOCUMENTS, RECORDS = 60, 40, 24
"""Damaged shards, metadata and records of jobs; as many at a time as `TOGETHER`."""
TOGETHER = 12

Harm = Callable[[Path, np.random.Generator], None]
Touched = list[Path]


def flip(path: Path, random: np.random.Generator) -> None:
    content = bytearray(path.read_bytes())
    bit = int(random.integers(8 * len(content)))
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


def truncate(path: Path, random: np.random.Generator) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: int(random.integers(1, len(content)))])


def empty(path: Path, random: np.random.Generator) -> None:
    path.write_bytes(b"")


def delete(path: Path, random: np.random.Generator) -> None:
    path.unlink()


def append(path: Path, random: np.random.Generator) -> None:
    with path.open("ab") as file:
        file.write(random.bytes(16))


def into_folder(path: Path, random: np.random.Generator) -> None:
    path.unlink()
    path.mkdir()


def into_pipe(path: Path, random: np.random.Generator) -> None:
    path.unlink()
    os.mkfifo(path)


def into_loop(path: Path, random: np.random.Generator) -> None:
    path.unlink()
    path.symlink_to(path.name)


def into_device(path: Path, random: np.random.Generator) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


HARMS: dict[str, Harm] = {
    "flipped bit": flip,
    "truncated": truncate,
    "emptied": empty,
    "deleted": delete,
    "appended to": append,
    "made a folder": into_folder,
    "made a pipe": into_pipe,
    "made a link to itself": into_loop,
    "made a link to a device that never ends": into_device,
}


def tried(folder: Path, child: Child, random: np.random.Generator, marker: Path) -> Iterator[Trial]:
    """Harm a copy of the repository in every way, one after the other or several at a time."""
    harmed = _Harmed(folder, child, marker)
    yield from _damaged(harmed, random)
    yield from _exchanged(harmed)
    yield from _planted(harmed, marker)
    yield from _scratch(harmed, random, marker)
    yield from _forged(harmed)


class _Harmed:
    """A copy of the repository that is made whole again after each harm.

    Attributes
    ----------
    folder : Path
    victim : Path
        A file beside it that nothing may touch, and no command may take along.
    """

    def __init__(self, folder: Path, child: Child, marker: Path) -> None:
        self._whole, self.folder, self.victim = folder / "whole", folder / "sample", folder / "victim"
        shutil.copytree(shipped.sample(), self._whole)
        drawn = [self._whole / "report.html", *(self._whole / f"figures/{name}.png" for name in ("loop", "strain"))]
        for number, file in enumerate(drawn):
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(bytes([number]) * 1000)
        commit_beside(self._whole, self._whole / "ledger/report.json", drawn)
        shutil.copytree(self._whole, self.folder)
        self.victim.write_text("mine alone")
        self.child, self._marker = child, marker

    def names(self, pattern: str) -> list[str]:
        """Paths of files of the whole repository, sorted."""
        found = (path.relative_to(self._whole).as_posix() for path in self._whole.rglob("*") if path.is_file())
        return sorted(name for name in found if re.fullmatch(pattern, name))

    def command(self, *arguments: str) -> Answer:
        return self.child("echotruth", arguments=[*arguments])

    def check(self, *options: str) -> Answer:
        return self.command("check", str(self.folder), *options)

    def heal(self) -> None:
        """Make the copy whole again."""
        before = {path.relative_to(self._whole): path.stat() for path in self._whole.rglob("*") if path.is_file()}
        for path in sorted(self.folder.rglob("*"), reverse=True):
            name = path.relative_to(self.folder)
            is_file = path.is_file() and not path.is_symlink()
            if name in before and is_file and path.read_bytes() == (self._whole / name).read_bytes():
                continue
            if path.is_dir() and not path.is_symlink():
                if not (self._whole / name).is_dir():
                    shutil.rmtree(path)
            else:
                path.unlink()
        for name in before:
            if not (self.folder / name).exists():
                (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(self._whole / name, self.folder / name)

    def trial(self, kind: str, name: str, outcome: str, said: str) -> Trial:
        """The trial, if no file outside was touched and no code was run."""
        if not self.victim.exists() or self.victim.read_text() != "mine alone":
            self.victim.write_text("mine alone")
            outcome = OUTSIDE
        if self._marker.exists():
            self._marker.unlink()
            outcome = EXECUTED
        return Trial(PART, kind, name, outcome, said)


def _found(answer: Answer, name: str) -> tuple[str, str]:
    """Outcome of damage to a file, and the line in which it was named."""
    if answer.fault:
        return answer.fault, answer.text[-800:]
    # A node of the hierarchy is named by its array, what is a folder now by its files.
    node = name.removesuffix("/zarr.json")
    lines = [line for line in answer.text.splitlines() if line.partition(": ")[0] in (name, node)]
    lines += [line for line in answer.sentences if name in line]
    if lines:
        return FOUND, lines[0][:300]
    return SILENT, answer.text[-300:]


def _damaged(harmed: _Harmed, random: np.random.Generator) -> Iterator[Trial]:
    """Harm shards, metadata and records several at a time, all other files one after the other."""
    store = re.escape(STORE)
    groups = {
        "shard": (harmed.names(rf"{store}/.*/c/.*"), SHARDS),
        "metadata": (harmed.names(rf"{store}/(?!.*/c/).*"), DOCUMENTS),
        "record of a job": (harmed.names(r"ledger/.*/.*\.json"), RECORDS),
    }
    for group, (names, count) in groups.items():
        chosen = random.choice(names, count, replace=count > len(names))
        harms = [list(HARMS)[number % len(HARMS)] for number in range(count)]
        for first in range(0, count, TOGETHER):
            together = slice(first, first + TOGETHER)
            pairs = list(dict(zip(chosen[together], harms[together], strict=True)).items())
            for name, harm in pairs:
                HARMS[harm](harmed.folder / name, random)
            answer = harmed.check("--quick")
            harmed.heal()
            for name, harm in pairs:
                outcome, said = _found(answer, name)
                if (group, harm) == ("record of a job", "deleted") and "jobs have not been run yet" in answer.text:
                    outcome, said = FOUND, "jobs have not been run yet"
                yield harmed.trial(f"{group} {harm}", name, outcome, said)
    beside = harmed.names(r"[^/]*|cases/healthy.json|figures/loop.png|ledger/[^/]*\.json")
    for name in beside:
        for harm, act in HARMS.items():
            act(harmed.folder / name, random)
            yield _beside(harmed, name, harm)
            harmed.heal()


TOLD = {"ledger/repository.json": "the repository has not been published yet"}
"""File that a run writes last of all -> what is said if it is not there."""


READ = ("truncated", "deleted", "appended to", "made a folder", "made a pipe")
"""Harms of which `info` and `status` are asked too."""


def _beside(harmed: _Harmed, name: str, harm: str) -> Trial:
    """Harm to a file beside the hierarchy, which other commands read as well."""
    answer = harmed.check("--quick")
    outcome, said = _found(answer, name)
    if outcome == SILENT and name in TOLD and TOLD[name] in answer.text:
        outcome, said = FOUND, TOLD[name]
    if outcome == SILENT and answer.status == 2 and name == "config.yaml":
        # Without it the folder is no repository, and is named as a whole.
        outcome, said = answer.refusal(harmed.folder.name), answer.text[-300:]
    if outcome == SILENT and name in ("registry.txt", "views.txt") and _rows(harmed, name):
        outcome, said = ACCEPTED, "the rows are those of before; a run that was broken off may have added others"
    for command in ("info", "status") if harm in READ else ():
        other = harmed.command(command, str(harmed.folder))
        if other.fault or (other.status == 2 and other.refusal() != REFUSED):
            outcome, said = other.fault or UNCLEAR, f"echotruth {command}: {other.text[-800:]}"
    return harmed.trial(f"file beside the hierarchy {harm}", name, outcome, said)


def _rows(harmed: _Harmed, name: str) -> bool:
    """Whether the rows of a registry begin with those of before."""
    before = (shipped.sample() / name).read_text().split()
    path = harmed.folder / name
    return path.is_file() and path.read_text(errors="replace").split()[: len(before)] == before


def _exchanged(harmed: _Harmed) -> Iterator[Trial]:
    """Exchange two files."""
    store = re.escape(STORE)
    images, records = harmed.names(rf"{store}/bmode/{SIZE}/image/c/.*"), "ledger/{}/healthy/{}/256.json"
    pairs = {
        "shards of an array": (images[0], images[-1]),
        "shards of two arrays": (images[0], images[0].replace("bmode/256/image", "truth/256/tissue")),
        "metadata of two arrays": tuple(
            f"{STORE}/{path}/zarr.json" for path in ("bmode/256/image", "truth/256/strain")
        ),
        "metadata of two groups": tuple(f"{STORE}/{path}/zarr.json" for path in ("bmode/256", "truth/256")),
        "metadata and a shard": (f"{STORE}/bmode/256/image/zarr.json", images[1]),
        "coordinates": tuple(f"{STORE}/{path}/c/0" for path in ("truth/256/view", "truth/256/to")),
        "records of two views": (records.format("bmode", "mid"), records.format("bmode", "long_axis")),
        "records of two stages": (records.format("bmode", "mid"), records.format("truth", "mid")),
        "records of two hearts": ("ledger/mechanics/healthy.json", "ledger/mechanics/infarct.json"),
        "records of structure and configuration": ("ledger/structure.json", "ledger/configuration.json"),
        "records of publication and report": ("ledger/repository.json", "ledger/report.json"),
        "configurations of two hearts": ("cases/healthy.json", "cases/infarct.json"),
        "the configuration and the table": ("config.yaml", "cases.csv"),
        "both registries": ("registry.txt", "views.txt"),
        "report and figure": ("report.html", "figures/loop.png"),
        "figures": ("figures/loop.png", "figures/strain.png"),
    }
    for name, pair in pairs.items():
        one, other = (harmed.folder / path for path in pair)
        contents = one.read_bytes(), other.read_bytes()
        one.write_bytes(contents[1])
        other.write_bytes(contents[0])
        answer = harmed.check("--quick")
        harmed.heal()
        outcomes = [_found(answer, path) for path in pair]
        # By another configuration nothing else can be judged, and what cannot be read of it ends the check.
        named = outcomes[:1] if pair[0] == "config.yaml" else outcomes
        yield harmed.trial("exchanged", name, *next((each for each in named if each[0] != FOUND), named[0]))


UNREAD = "nothing reads a file of this name"


def _planted(harmed: _Harmed, marker: Path) -> Iterator[Trial]:
    """Plant files, pickles before all."""
    content = pickled(marker)
    image = f"{STORE}/bmode/256/image"
    strangers = [
        f"{STORE}/evil.pkl",
        f"{image}/c/9/9/0/0/0",
        f"{image}/0.0.0.0.0",
        f"{image}/c/.1.partial",
        f"{STORE}/x/zarr.json",
    ]
    strangers += ["ledger/mechanics/evil.json", "ledger/bmode/healthy/evil/256.json", "ledger/bmode/evil/mid/256.json"]
    unread = [
        "evil.pkl",
        "scratch/healthy/mid/scatterers.frame",
        "scratch/evil.npz",
        "figures/evil.pkl",
        "ledger/evil.pkl",
    ]
    unread += [
        "cases/evil.json",
        "external/evil.zarr/zarr.json",
        "logs/snakemake.log",
        "sitecustomize.py",
        "numpy.py",
        ".frame",
    ]
    for name in (*strangers, *unread):
        path = harmed.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        answer = harmed.check("--quick")
        outcome, said = _found(answer, name)
        if outcome == SILENT and name in unread:
            outcome, said = ACCEPTED, UNREAD
        for command in ("info", "status"):
            other = harmed.command(command, str(harmed.folder))
            outcome, said = (other.fault, other.text[-800:]) if other.fault else (outcome, said)
        harmed.heal()
        yield harmed.trial("planted", name, outcome, said)
    for name in [
        f"{image}/c/0/0/0/0/0",
        f"{image}/zarr.json",
        f"ledger/mechanics/{CASE}.json",
        "cases/healthy.json",
        "config.yaml",
    ]:
        (harmed.folder / name).write_bytes(content)
        answer = harmed.check("--quick")
        read = harmed.child("read_array", folder=str(harmed.folder), path="bmode/256/image")
        outcome, said = _found(answer, name)
        harmed.heal()
        yield harmed.trial("pickle in place of a file", name, read.fault or outcome, said)
    yield _pickled_codec(harmed, content)


def _pickled_codec(harmed: _Harmed, content: bytes) -> Trial:
    """An array of Zarr's earlier format, whose chunks are pickles, in place of one."""
    array = harmed.folder / STORE / "bmode/256/image"
    shutil.rmtree(array)
    array.mkdir()
    metadata = {"zarr_format": 2, "shape": [1], "chunks": [1], "dtype": "|O", "fill_value": "", "order": "C"}
    codecs = {"filters": [{"id": "vlen-utf8"}, {"id": "pickle"}], "compressor": None}
    (array / ".zarray").write_text(json.dumps(metadata | codecs))
    (array / "0").write_bytes(content)
    answer = harmed.check("--quick")
    read = harmed.child("read_array", folder=str(harmed.folder), path="bmode/256/image")
    harmed.heal()
    outcome, said = _found(answer, f"{STORE}/bmode/256/image/zarr.json")
    if not read.fault and (read.status == 0 or "has no array" not in read.text):
        outcome, said = SILENT, f"read as an array: {read.text[-300:]}"
    return harmed.trial("pickle in place of a file", "an array with a codec of pickles", read.fault or outcome, said)


def _scratch(harmed: _Harmed, random: np.random.Generator, marker: Path) -> Iterator[Trial]:
    """Harm what one stage passes on to the next, of which check does not know: the stage that reads it must refuse."""
    file = harmed.folder / "scratch" / CASE / VIEW / "scatterers.npz"
    file.parent.mkdir(parents=True)
    whole = {"position": random.random((500, 3)), "amplitude": random.random(500)}
    header = np.lib.format.header_data_from_array_1_0(np.empty(1, object))
    for number in range(12):
        file.unlink(missing_ok=True)
        np.savez(file, **whole)
        name, harm = list(HARMS.items())[number % 4] if number < 12 else ("", flip)
        harm(file, random)
        yield _passed_on(harmed, f"scratch file {name}", str(number), file, whole)
    for name in ("in place of the file", "in place of an array", "in an array of objects"):
        file.unlink(missing_ok=True)
        content = pickled(marker)
        if name != "in place of the file":
            with zipfile.ZipFile(file, "w") as archive, archive.open("position.npy", "w") as entry:
                if name == "in an array of objects":
                    np.lib.format.write_array_header_1_0(entry, header)
                entry.write(content)
        else:
            file.write_bytes(content)
        yield _passed_on(harmed, "pickle in a scratch file", name, file, whole)
    harmed.heal()


def _passed_on(harmed: _Harmed, kind: str, name: str, file: Path, whole: dict[str, Any]) -> Trial:
    try:
        with np.load(file, allow_pickle=False) as opened:
            same = all(np.array_equal(opened[key], whole[key]) for key in whole)
    except Exception:
        same = False
    answer = harmed.child("passed_on", folder=str(harmed.folder), case=CASE, view=VIEW)
    outcome, said = answer.refusal(file.name), answer.text[-300:]
    if not answer.fault and answer.status == 0:
        outcome, said = (ACCEPTED, "what it holds is what was written") if same else (SILENT, answer.text)
    return harmed.trial(kind, name, outcome, said)


def _forged(harmed: _Harmed) -> Iterator[Trial]:
    """Records that someone wrote who can make checksums fit."""
    for name, (record, changes) in _records(harmed).items():
        path = harmed.folder / record
        known = ledger.read(path)
        path.write_text(_sealed(known | changes) if isinstance(changes, dict) else changes)
        answer = harmed.check("--heal")
        outcome, said = _found(answer, record)
        if outcome == SILENT and name.startswith("harmless"):
            outcome, said = ACCEPTED, "no job and no table depends on it"
        for command in ("info", "status"):
            other = harmed.command(command, str(harmed.folder))
            outcome, said = (other.fault, f"{command}: {other.text[-800:]}") if other.fault else (outcome, said)
        harmed.heal()
        yield harmed.trial("forged record", name, outcome, said)
    for name, changes in DOCUMENTS_FORGED.items():
        yield _forged_metadata(harmed, name, changes)
    yield from _taken_along(harmed)


def _sealed(record: dict[str, Any]) -> str:
    """Text of a record with the seal that it would have."""
    seal = sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()[:16]
    return json.dumps(record | {"seal": seal}, sort_keys=True)


def _records(harmed: _Harmed) -> dict[str, tuple[str, dict[str, Any] | str]]:
    """Name -> record that is forged, and the entries that change, or its text."""
    job, heart = f"ledger/bmode/{CASE}/{VIEW}/{SIZE}.json", f"ledger/mechanics/{CASE}.json"
    hashes = ledger.read(harmed.folder / job)["sha256"]
    wrong, victim = "0" * 64, os.path.relpath(harmed.victim, harmed.folder / STORE)
    beside = os.path.relpath(harmed.victim, harmed.folder)
    configuration = ledger.read(harmed.folder / "ledger/configuration.json")["files"]
    structure = ledger.read(harmed.folder / "ledger/structure.json")["sha256"]
    deep = '{"a":' * 100_000 + "1" + "}" * 100_000
    return {
        "a job that names a file outside": (job, {"sha256": hashes | {victim: wrong}}),
        "a job that names a file of the machine": (job, {"sha256": hashes | {str(harmed.victim): wrong}}),
        "a structure that names a file outside": ("ledger/structure.json", {"sha256": structure | {victim: wrong}}),
        "a configuration that names a file outside": (
            "ledger/configuration.json",
            {"files": configuration | {beside: wrong}},
        ),
        "a report that names a file outside": ("ledger/report.json", {"files": {beside: wrong}}),
        "a job without files": (job, {"sha256": {}}),
        "a job with a list of files": (job, {"sha256": list(hashes)}),
        "a job with numbers for checksums": (job, {"sha256": dict.fromkeys(hashes, 0)}),
        "a job with another's file": (job, {"sha256": hashes | {"bmode/256/image/c/1/0/0/0/0": wrong}}),
        "a job that failed": (job, {"status": "failed", "reason": "none"}),
        "a job of no known status": (job, {"status": ["complete"]}),
        "a job of another heart": (job, {"case": "infarct"}),
        "a job of other settings": (job, {"settings": "0" * 16}),
        "settings that are a number": (job, {"settings": 1}),
        "a heart with text for its bounds": (heart, {"bounded": {"volume_ratio_min": "high"}}),
        "a heart with a list for its bounds": (heart, {"bounded": [1, 2]}),
        "a heart with nothing for its bounds": (heart, {"bounded": None}),
        "a list": (job, "[1, 2]"),
        "a number": (heart, "1e999"),
        "a text": ("ledger/structure.json", '"sha256"'),
        "null": ("ledger/repository.json", "null"),
        "of a hundred thousand levels": (job, deep),
        "of a hundred thousand levels, the structure": ("ledger/structure.json", deep),
        "of a hundred thousand levels, the configuration": ("ledger/configuration.json", deep),
        "a number of a hundred thousand digits": (heart, '{"seed": ' + "9" * 100_000 + "}"),
        "a configuration of lists": ("ledger/configuration.json", {"files": [["config.yaml"]]}),
        "a structure of numbers": ("ledger/structure.json", {"sha256": {"zarr.json": 1}}),
    }


DOCUMENTS_FORGED: dict[str, dict[str, Any] | str] = {
    "another shape": {"shape": [2**62] * 5},
    "a negative shape": {"shape": [-1] * 5},
    "chunks of nothing": {"chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [0] * 5}}},
    "an unknown codec": {"codecs": [{"name": "pickle"}]},
    "no codec": {"codecs": []},
    "another type": {"data_type": "float64"},
    "a type that is none": {"data_type": {"name": "object"}},
    "attributes that are a list": {"attributes": []},
    "units that are a number": {"attributes": {"units": 1}},
    "another format": {"zarr_format": 2},
    "a storage transformer": {"storage_transformers": [{"name": "x"}]},
    "a fill value that is text": {"fill_value": "dark"},
    "a hundred thousand levels": '{"a":' * 100_000 + "1" + "}" * 100_000,
    "a list": "[]",
}
"""Name -> entries of the metadata of an array that change, or their text, with a checksum that fits."""


def _forged_metadata(harmed: _Harmed, name: str, changes: dict[str, Any] | str) -> Trial:
    path, record = harmed.folder / STORE / "bmode/256/image/zarr.json", harmed.folder / "ledger/structure.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes) if isinstance(changes, dict) else changes)
    known = ledger.read(record)
    known["sha256"]["bmode/256/image/zarr.json"] = sha256(path.read_bytes()).hexdigest()
    record.write_text(_sealed(known))
    answer = harmed.check()
    read = harmed.child("read_array", folder=str(harmed.folder), path="bmode/256/image")
    harmed.heal()
    outcome, said = answer.fault or SILENT, answer.text[-800:]
    lines = [line for line in answer.text.splitlines() if line.startswith(f"{STORE}/bmode/256")]
    if not answer.fault and lines:
        outcome, said = FOUND, lines[0][:300]
    return harmed.trial("forged metadata", name, read.fault or outcome, said)


GIVEN = ["--license", "CC-BY-4.0", "--author", "Doe, Jane", "--date", "2026-01-01"]
"""What a release has to be given."""


def _taken_along(harmed: _Harmed) -> Iterator[Trial]:
    """Commands that pass files on, of a repository whose records name one outside."""
    job = harmed.folder / f"ledger/bmode/{CASE}/{VIEW}/{SIZE}.json"
    structure = harmed.folder / "ledger/structure.json"
    checksum, outside = (
        sha256(harmed.victim.read_bytes()).hexdigest(),
        os.path.relpath(harmed.victim, harmed.folder / STORE),
    )
    passed_on = [(job, "merge"), (job, "release"), (structure, "release")]
    # A release needs the extra `description`.
    for record, command in passed_on if find_spec("mlcroissant") else passed_on[:1]:
        known = ledger.read(record)
        known["sha256"][outside] = checksum
        record.write_text(_sealed(known))
        target = harmed.folder.with_name("taken")
        order = (
            [str(target), str(harmed.folder)]
            if command == "merge"
            else [str(harmed.folder), "--to", str(target), *GIVEN]
        )
        answer = harmed.command(command, *order)
        outcome, said = answer.refusal(record.name), answer.text[-300:]
        if not answer.fault and (answer.status == 0 or _holds(target, harmed.victim.read_bytes())):
            outcome = OUTSIDE
        harmed.heal()
        shutil.rmtree(target, ignore_errors=True)
        yield harmed.trial("forged record passed on", f"{command}, {record.name}", outcome, said)


def _holds(folder: Path, content: bytes) -> bool:
    """Whether a file below a folder holds a content."""
    return any(content in path.read_bytes() for path in folder.rglob("*") if path.is_file())

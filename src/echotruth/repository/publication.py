"""Publication of a repository: its table of cases, the metadata of its folders, and the checksums of its files."""

from __future__ import annotations

import json
from collections.abc import Collection
from hashlib import sha256
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echotruth import files
from echotruth.cases import Case, table
from echotruth.config import Config
from echotruth.config.diagnosis import bounds_of
from echotruth.repository import metadata
from echotruth.repository.checksums import CHECKSUMS, METADATA, checksum, files_of, lines_of, read_lines, sealed
from echotruth.repository.places import NESTED, groups_of, jobs_of, place
from echotruth.repository.status import verdict
from echotruth.repository.version import packages

if TYPE_CHECKING:
    import pandas as pd

TEXTS = ("cases.csv", "config.yaml")
"""Files in the folder of a repository that describe it."""

LARGEST_TREE = 50_000
"""Groups and arrays up to which the root of a repository has the metadata of all of them, about 1 kB each; in a larger
one, only each heart and each clip has that of its own."""


def publish(folder: Path, config: Config, cases: list[Case]) -> dict[str, int]:
    """Write what belongs to no job, and last the checksums.

    The checksums of what jobs wrote are as the jobs stored them: what became of these files since is found by whoever
    compares them.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    config : Config
    cases : list of Case

    Returns
    -------
    dict
        Number of cases by their status.
    """
    store = folder / f"{config.name}.zarr"
    summary = table_of(store, cases)
    files.update(folder / "cases.csv", as_csv(summary))
    hashes = {f"{store.name}/{name}": hash for name, hash in _publish_groups(store, config, cases).items()}
    hashes |= {name: checksum(folder / name) for name in TEXTS}
    files.write(folder / CHECKSUMS, lines_of(hashes).encode())
    return {str(status): int(number) for status, number in summary["status"].value_counts(sort=False).items()}


def table_of(store: Path, cases: list[Case]) -> pd.DataFrame:
    """Table of the cases, with what became of their hearts until now."""
    found = [verdict(metadata.attributes(store / "hearts" / case.heart), bounds_of(case.config)) for case in cases]
    columns = table(cases)
    columns.insert(1, "heart", [case.heart for case in cases])
    columns.insert(2, "status", [one.status for one in found])
    columns.insert(3, "reason", [one.reason for one in found])
    return columns


def as_csv(summary: pd.DataFrame) -> bytes:
    """Content of cases.csv."""
    return summary.to_csv(index=False).encode()


def asked_for(cases: list[Case]) -> list[str]:
    """Paths of all groups of jobs that the cases ask for, those of a heart once."""
    paths = (
        place(group, case.heart, case.id, job.view)
        for case in cases
        for job in jobs_of(case.id, case.config)
        for group in groups_of(job.stage, case.config.image_names, job.tracker)
    )
    return list(dict.fromkeys(paths))


def holders(config: Config, cases: list[Case]) -> dict[str, dict[str, Any]]:
    """Groups that hold those of the jobs: path below the store, "" for its root, -> attributes."""
    found: dict[str, dict[str, Any]] = {"": _attributes(config), "hearts": {}, "clips": {}}
    if config.inference.tracker:
        found["inference"] = {}
    for case in cases:
        found[f"clips/{case.id}"] = {}
        for view in config.views:
            found[f"clips/{case.id}/{view}"] = {"case": case.id, "view": view, "heart": case.heart}
            found |= {f"clips/{case.id}/{view}/{stage}": {} for stage in NESTED}
    return found


def published_checksums(folder: Path) -> dict[str, str]:
    """Checksums of the published files by their paths below the folder of a repository; none if it is not finished."""
    path = folder / CHECKSUMS
    return read_lines(path.read_text(encoding="utf-8", errors="replace")) if path.is_file() else {}


def write_holders(store: Path, config: Config, cases: list[Case]) -> None:
    """Write the groups that hold those of the jobs, so that what is made can be read while the rest is being made.

    Those of cases and views that are no more are removed: what they held is no part of the repository.
    """
    wanted = holders(config, cases)
    _remove_others(store, wanted)
    for name, attributes in wanted.items():
        files.update(store / name / METADATA, metadata.content(attributes))


def _remove_others(store: Path, wanted: Collection[str]) -> None:
    """Remove holders that are not wanted, and what a killed run left in those that are."""
    for pattern in ("inference", "clips/*", "clips/*/*", *(f"clips/*/*/{stage}" for stage in NESTED)):
        for path in store.glob(f"{pattern}/{METADATA}"):
            if path.parent.relative_to(store).as_posix() not in wanted:
                path.unlink()
    for name in wanted:
        files.remove_drafts(store / name)


def _publish_groups(store: Path, config: Config, cases: list[Case]) -> dict[str, str]:
    """Give the root and each clip the metadata of all that they hold.

    Returns
    -------
    dict of str
        Checksums of all files by their paths below the store.
    """
    held = holders(config, cases)
    _remove_others(store, held)
    contents = {path: metadata.content(attributes) for path, attributes in held.items()}
    hashes: dict[str, str] = {}
    tree: dict[str, Any] | None = {path: _document(attributes) for path, attributes in held.items() if path}
    groups = [path for path in asked_for(cases) if (store / path / METADATA).is_file()]
    for clip, members in groupby(sorted(groups, key=_clip_of), _clip_of):
        found: dict[str, Any] = {}
        for path in members:
            hashes |= _checksums(store, path)
            found |= metadata.below(store, path)
        if clip:
            inside = found | {f"{clip}/{stage}": _document({}) for stage in NESTED}
            below = {path.removeprefix(f"{clip}/"): document for path, document in inside.items()}
            files.update(store / clip / METADATA, metadata.content(held[clip], below))
            del contents[clip]
        if tree is not None:
            tree = tree | found if len(tree) + len(found) <= LARGEST_TREE else None
    contents[""] = metadata.content(held[""], tree)
    for path, content in contents.items():
        files.update(store / path / METADATA, content)
    return hashes | {f"{path}/{METADATA}".lstrip("/"): checksum(store / path / METADATA) for path in held}


def _clip_of(path: str) -> str:
    """Path of the clip that a group is of; empty if it is of none."""
    return "/".join(path.split("/")[:3]) if path.startswith("clips/") else ""


def _checksums(store: Path, path: str) -> dict[str, str]:
    """Checksums of the files of a group, as its job stored them, or of a group from before jobs did, as they are."""
    document = (store / path / METADATA).read_bytes()
    found = sealed(json.loads(document)) or {
        file.relative_to(store / path).as_posix(): checksum(file) for file in files_of(store / path)
    }
    found[METADATA] = sha256(document).hexdigest()
    return {f"{path}/{name}": hash for name, hash in found.items()}


def _document(attributes: dict[str, Any]) -> dict[str, Any]:
    """Metadata of a group that holds groups, within those of another one."""
    return json.loads(metadata.content(attributes))


def _attributes(config: Config) -> dict[str, Any]:
    return {
        "title": f"echotruth repository {config.name}: synthetic echocardiograms with their true motion",
        "summary": "Finite-element hearts, B-mode clips, the true motion of every pixel, and trackers scored by it",
        "references": "Mukherjee et al., Synthetic ultrasound images to benchmark echocardiography-based biomechanics",
        "config": config.model_dump(mode="json"),
        "seed": config.seed,
        "packages": packages(),
    }

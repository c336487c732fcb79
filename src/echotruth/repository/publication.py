"""Publication of a repository: its table of cases, the metadata of its folders, and the checksums of its files."""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import file_digest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echotruth import files
from echotruth.cases import Case, table
from echotruth.config import Config
from echotruth.config.diagnosis import bounds_of
from echotruth.repository import metadata
from echotruth.repository.places import METADATA, SIZED
from echotruth.repository.status import verdict
from echotruth.repository.version import packages

if TYPE_CHECKING:
    import pandas as pd

CHECKSUMS = "SHA256SUMS"
"""File with the checksums of the store and of the files beside it that describe it, as `sha256sum -c` reads it."""


def publish(folder: Path, config: Config, cases: list[Case]) -> dict[str, int]:
    """Write what belongs to no job, and last the checksums.

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
    _write_groups(store, config, cases)
    metadata.write(store, _attributes(config), consolidated=False)
    write_checksums(folder, store)
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


def _write_groups(store: Path, config: Config, cases: Iterable[Case]) -> None:
    """Write the groups that hold those of the jobs, and remove those of cases and views that are no more.

    A clip has the metadata of all that it holds.
    """
    clips = {store / "clips" / case.id / view: case for case in cases for view in config.views}
    holders = {store / "hearts", store / "clips", *(clip.parent for clip in clips)}
    holders |= {clip / stage for clip in clips for stage in SIZED}
    if config.inference.tracker:
        holders.add(store / "inference")
    wanted = {*holders, *clips}
    for pattern in ("inference", "clips/*", "clips/*/*", *(f"clips/*/*/{stage}" for stage in SIZED)):
        for path in store.glob(f"{pattern}/{METADATA}"):
            if path.parent not in wanted:
                path.unlink()
    for folder in holders:
        metadata.write(folder, {}, consolidated=False)
    for clip, case in clips.items():
        metadata.write(clip, {"case": case.id, "view": clip.name, "heart": case.heart})


def _attributes(config: Config) -> dict[str, Any]:
    return {
        "title": f"echotruth repository {config.name}: synthetic echocardiograms with their true motion",
        "summary": "Finite-element hearts, B-mode clips, the true motion of every pixel, and trackers scored by it",
        "references": "Mukherjee et al., Synthetic ultrasound images to benchmark echocardiography-based biomechanics",
        "config": config.model_dump(mode="json"),
        "seed": config.seed,
        "packages": packages(),
    }


def published_files(folder: Path, store: Path) -> list[Path]:
    """Files that have a checksum: all groups of the store, the configuration and the table of the cases."""
    below = (path for path in metadata.files_of(store) if path.suffix != ".partial")
    return sorted([*below, folder / "cases.csv", folder / "config.yaml"])


def checksum(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def write_checksums(folder: Path, store: Path) -> None:
    """Write the checksums of all files of a repository."""
    lines = [f"{checksum(path)}  {path.relative_to(folder).as_posix()}\n" for path in published_files(folder, store)]
    files.write(folder / CHECKSUMS, "".join(lines).encode())

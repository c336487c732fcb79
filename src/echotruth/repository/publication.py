"""Publication of a repository: verification of its files against the ledger, verdicts and attributes."""

from pathlib import Path
from typing import Any

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.config.loading import load
from echotruth.repository import ledger
from echotruth.repository.checksums import verify, verify_structure
from echotruth.repository.ledger import record_paths
from echotruth.repository.provenance import packages
from echotruth.repository.store import Store
from echotruth.repository.verdict import Verdict, verdict


def publish(folder: Path) -> dict[str, Any]:
    """Verify every file of the store against the ledger, then write the verdicts and the attributes of the repository.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.

    Returns
    -------
    dict
        Number of complete, implausible and failed cases, and of verified files.

    Raises
    ------
    ChecksumError
        If a file is missing or differs from what was written.
    """
    config = load(folder / "config.yaml")
    store = Store(folder / f"{config.name}.zarr")
    rows = ledger.rows(folder / "registry.txt")
    cases = expand(config)
    records = {case.id: record_paths(folder, case.id, config) for case in cases}
    files = verify_structure(store.path, store.record)
    files += sum(verify(store.path, path, ledger.read(path)) for paths in records.values() for path in paths)
    verdicts = {case.id: verdict(ledger.read(records[case.id][0]), case.config.physiology) for case in cases}
    retired = Verdict("retired", "not a case of this configuration")
    for column in ("status", "reason"):
        store.write_column(column, [getattr(verdicts.get(case, retired), column) for case in rows])
    store.describe(_attributes(config, records))
    statuses = [found.status for found in verdicts.values()]
    return {status: statuses.count(status) for status in ("complete", "implausible", "failed")} | {"files": files}


def _attributes(config: Config, records: dict[str, list[Path]]) -> dict[str, Any]:
    first = next(iter(records.values()))
    return {
        "title": f"echotruth repository {config.name}: synthetic echocardiograms with their true motion",
        "summary": "Finite-element hearts, B-mode clips, the true motion of every pixel, and trackers scored by it",
        "references": "Mukherjee et al., Synthetic ultrasound images to benchmark echocardiography-based biomechanics",
        "config": config.model_dump(mode="json"),
        "seed": config.seed,
        "code": {record["stage"]: record["code"] for record in map(ledger.read, first)},
        "packages": packages(),
    }

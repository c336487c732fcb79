"""Verdict on a heart: whether it is solved, and within the bounds of the section `physiology`."""

from pathlib import Path
from typing import Any, NamedTuple

from echotruth.config import Config
from echotruth.config.physiology import Physiology
from echotruth.mechanics.bounds import violation
from echotruth.repository import ledger
from echotruth.repository.ledger import record_path


class Verdict(NamedTuple):
    """What a heart is.

    Attributes
    ----------
    status : str
        complete, implausible (out of the bounds of physiology) or failed (no solution).
    reason : str
        Why it is not complete.
    """

    status: str
    reason: str = ""


def verdict(record: dict[str, Any], bounds: Physiology) -> Verdict:
    """Verdict on a heart.

    Parameters
    ----------
    record : dict
        Record of its mechanics, with the values that are `bounded`.
    bounds : Physiology
        Bounds of today: a bound that is changed does not solve the heart again.
    """
    if record["status"] != "complete":
        return Verdict("failed", record.get("reason", ""))
    reason = violation(record.get("bounded", {}), bounds)
    return Verdict("implausible", reason) if reason else Verdict("complete")


def excluded(folder: Path, case: str, config: Config) -> str:
    """Why a heart is not imaged; empty if it is imaged, or not solved yet.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    case : str
    config : Config
        Configuration of the case.
    """
    path = record_path(folder, "mechanics", case)
    if not path.is_file():
        return ""
    found = verdict(ledger.read(path), config.physiology)
    accepted = ledger.imaged_statuses(config.physiology.exclude_implausible)
    return "" if found.status in accepted else found.reason or found.status

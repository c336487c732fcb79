"""What became of a heart: whether it is solved and within the bounds of `physiology`, and the table of all cases."""

from __future__ import annotations

from typing import IO, TYPE_CHECKING, Any, NamedTuple

from echotruth.config.physiology import Physiology
from echotruth.mechanics.bounds import violation

if TYPE_CHECKING:
    import pandas as pd

ALWAYS = ("status", "reason", "heart")
"""Columns of the table of cases that it always has."""


class Verdict(NamedTuple):
    """What became of a heart.

    Attributes
    ----------
    status : str
        complete, implausible (out of the bounds of physiology), failed (no solution) or unfinished.
    reason : str
        Why it is not complete.
    """

    status: str
    reason: str = ""


def verdict(attributes: dict[str, Any], bounds: Physiology) -> Verdict:
    """Verdict on a heart.

    Parameters
    ----------
    attributes : dict
        Of the group of the heart, with the values that are `bounded`; empty if there is none.
    bounds : Physiology
        Bounds of today: a bound that is changed does not solve the heart again.
    """
    if not attributes:
        return Verdict("unfinished")
    if attributes["status"] != "complete":
        return Verdict("failed", attributes.get("reason", ""))
    reason = violation(attributes.get("bounded", {}), bounds)
    return Verdict("implausible", reason) if reason else Verdict("complete")


def imaged(exclude_implausible: bool) -> tuple[str, ...]:
    """Statuses of the hearts that are imaged and tracked, by the key `physiology.exclude_implausible`."""
    return ("complete",) if exclude_implausible else ("complete", "implausible")


def excluded(attributes: dict[str, Any], bounds: Physiology) -> str:
    """Why a heart is not imaged; empty if it is imaged, or not solved yet; parameters as of :func:`verdict`."""
    found = verdict(attributes, bounds)
    accepted = imaged(bounds.exclude_implausible)
    return "" if found.status in (*accepted, "unfinished") else found.reason or found.status


def is_label(name: str) -> bool:
    """Whether a column is a label, and not a key of the configuration."""
    return name in ("diagnosis", "note") or name.startswith("label.")


def read_table(file: IO[bytes], source: str) -> pd.DataFrame:
    """Table of the cases, indexed by `case`, from cases.csv; a text column has "" where it is empty.

    Raises
    ------
    FileNotFoundError
        If it is damaged.
    """
    import pandas as pd

    try:
        table = pd.read_csv(file, dtype={"case": str, "heart": str, "status": str, "reason": str}).set_index("case")
        table["heart"]
    except (ValueError, KeyError):
        remedy = "run the configuration again, which writes it"
        raise FileNotFoundError(f"{source}: cases.csv is damaged: {remedy}") from None
    texts = {name: "" for name in table if not pd.api.types.is_numeric_dtype(table[name])}
    return table.fillna(texts).copy()  # in one piece, so that columns are added without a warning

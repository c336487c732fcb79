"""Table of the cases of a repository: what became of them, their labels, and the keys in which they differ."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from echotruth.repository.reader import Repository

UNFINISHED = "unfinished"
"""Status of a case that no run has published."""
MOTION = ("geometry.", "fibres.", "pathology.", "loop.", "mechanics.", "motion.")
"""Keys on which the motion of a heart depends."""


def table_of(repository: Repository) -> pd.DataFrame:
    """Verdict, heart, labels and differing keys of each case, as :attr:`Repository.cases` describes them."""
    import pandas as pd

    names = repository.names("cases")
    if not names:
        return pd.DataFrame({"status": UNFINISHED, "reason": ""}, pd.Index(repository.rows, name="case"))
    columns = {name: repository.read(f"cases/{name}", ...) for name in names}
    found = pd.DataFrame({name: _plain(values) for name, values in columns.items()}).set_index("case")
    known = {key: value for key, value in constants(repository).items() if key not in found and is_label(key)}
    found = found.assign(**known)
    found["status"] = found["status"].replace("", UNFINISHED)
    found["heart"] = _hearts(found)
    first = ["status", "reason", "heart", *(name for name in found if is_label(name))]
    return found[[*first, *(name for name in found if name not in first)]]


def constants(repository: Repository) -> dict[str, Any]:
    """Value of every key that is the same in all cases."""
    return dict(repository.attributes("cases")["constants"])


def is_label(name: str) -> bool:
    """Whether a column is a label, and not a key of the configuration."""
    return name in ("diagnosis", "note") or name.startswith("label.")


def _plain(values: np.ndarray) -> np.ndarray:
    return values if values.dtype.kind in "fiub" else np.array([str(value) for value in values], object)


def _hearts(found: pd.DataFrame) -> list[str]:
    """The first case of each row's motion.

    Hearts whose only difference is the seed of their fibres' disarray count as one: they resemble each other.
    """
    keys = [name for name in found if str(name).startswith(MOTION)]
    first: dict[tuple[Any, ...], str] = {}
    hearts = []
    for case, status, *values in found[["status", *keys]].fillna("").itertuples():
        hearts.append(case if status == "retired" else first.setdefault(tuple(values), case))
    return hearts

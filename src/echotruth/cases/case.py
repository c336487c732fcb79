"""A case of the sweep, and what is known of it before its configuration is made."""

from dataclasses import dataclass, field
from typing import Any

from echotruth.config import Config

Label = str | float | None
"""Value of a label: a number if all that its column holds are numbers; None in an empty cell."""


@dataclass(frozen=True)
class Case:
    """One row of the sweep: a heart and its imaging. Several cases may share one heart (docs/conventions.md)."""

    id: str
    """Readable and stable: given by the table, or else it depends only on the swept keys whose value is not the one
    they have without the sweep."""
    parameters: dict[str, Any]
    """Swept dotted key -> value."""
    config: Config
    """Configuration of this case, without a sweep; cases share the sections in which they do not differ."""
    labels: dict[str, Label] = field(default_factory=dict)
    """Name -> value of the labels in the table, which nothing that is computed depends on."""
    note: str = ""
    """The note in the table."""
    heart: str = "heart"
    """Id of its heart, by the swept keys on which motion depends: cases that move alike share one."""


@dataclass(frozen=True)
class Combination:
    """A row of the table with values of the grid and of a draw."""

    parameters: dict[str, Any]
    """Swept dotted key -> value."""
    given_id: str = ""
    """Id of the row in the table; empty if it has none."""
    own: frozenset[str] = frozenset()
    """Keys that the row gives: they are in its id."""
    origin: str = ""
    """Where the values come from, for errors: "row 3", "draw 17"; empty if they are those of the grid alone."""
    labels: dict[str, Label] = field(default_factory=dict)
    note: str = ""

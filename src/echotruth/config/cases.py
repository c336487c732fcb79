"""Section `cases`: which hearts a configuration makes, by a grid, a table, random draws and conditions."""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, FiniteFloat, WithJsonSchema, model_serializer, model_validator

from echotruth.config.presets import PRESETS
from echotruth.config.reading import ConfigError, read_text
from echotruth.config.table import MAX_BYTES, MAX_CASES, TableError, parse, swept
from echotruth.section import Section, check, invalid

if TYPE_CHECKING:
    import pandas as pd

Pair = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]

MAX_KEYS = 1024
"""Drawn keys at most, as columns of a table."""
KINDS = ("uniform", "log_uniform", "normal", "integers", "choice")
"""Keys of a distribution of which one is given."""


class Distribution(Section):
    """Distribution of a drawn key: one of `uniform`, `log_uniform`, `normal`, `integers` and `choice`."""

    uniform: Pair | None = None
    """Lower and upper bound, between which all values are equally likely."""
    log_uniform: Pair | None = None
    """Lower and upper bound, both positive, between which the logarithm is uniform."""
    normal: Pair | None = None
    """Mean and standard deviation."""
    limits: Pair | None = None
    """With `normal`: lower and upper bound at which the distribution is truncated."""
    integers: Annotated[list[Annotated[int, Field(ge=0, lt=2**63)]], Field(min_length=2, max_length=2)] | None = None
    """First and last of the whole numbers, which are equally likely; for keys such as `seed`."""
    choice: Annotated[list[Any], Field(min_length=1)] | None = None
    """Values of which one is drawn."""
    weights: Annotated[list[Annotated[FiniteFloat, Field(ge=0)]], Field(min_length=1)] | None = None
    """With `choice`: weight of each value. Default: all are equally likely."""

    @property
    def kind(self) -> str:
        """The one of `KINDS` that is given."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    @model_serializer(mode="wrap")
    def _given(self, handler: Any) -> dict[str, Any]:
        return {key: value for key, value in handler(self).items() if value is not None}

    @check
    def _check_kind(self) -> None:
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            remedy = f"give one of {', '.join(KINDS)}"
            raise invalid(given[1] if given else "uniform", getattr(self, given[1]) if given else None, remedy)
        for key, needs in (("limits", "normal"), ("weights", "choice")):
            self.require(getattr(self, key) is None or given == [needs], key, f"applies to {needs}: leave it out")

    @check
    def _check_bounds(self) -> None:
        for key in ("uniform", "log_uniform", "integers", "limits"):
            low, high = getattr(self, key) or (0, 1)
            self.require(low < high, key, "must be the lower bound and then a greater upper bound")
        self.require((self.log_uniform or [1])[0] > 0, "log_uniform", "must have positive bounds")
        self.require((self.normal or [1])[-1] > 0, "normal", "must be the mean and a positive standard deviation")

    @check
    def _check_weights(self) -> None:
        if self.weights is None or self.choice is None:
            return
        remedy = f"must have one entry for each of the {len(self.choice)} of choice"
        self.require(len(self.weights) == len(self.choice), "weights", remedy)
        self.require(0 < sum(self.weights) < 1e300, "weights", "must have a positive entry and a finite sum")


POSES: dict[str, list[float]] = PRESETS["poses"]
"""Bounds of keys of every view that `cases.draw.preset: acoustics` draws uniformly, beside their value in the
configuration; lengths over `rf.focus_mm`."""
LEVELS: dict[str, list[float]] = PRESETS["levels"]
"""Bounds of keys that it draws so beside them, dB."""
DRAW_PRESETS: dict[str, dict[str, dict[str, Any]]] = PRESETS["draws"]
"""`cases.draw.preset` -> distributions of dotted keys."""
HEARTS = DRAW_PRESETS["hearts"]
"""Distributions of `cases.draw.preset: hearts`."""


def _as_list(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


def _preset_list(value: Any) -> Any:
    """A list of a name, empty for `none`, which stored configurations of version 0.1 have."""
    return [] if value == "none" else _as_list(value)


def presets_of(draw: dict[str, Any]) -> list[str]:
    """Names of the presets that the section `cases.draw` asks for, as far as they are known."""
    given = _as_list(draw.get("preset"))
    return [name for name in DRAW_PRESETS if isinstance(given, list) and name in given]


class Draw(Section):
    """Hearts drawn at random: each has one value of every key in `keys`."""

    preset: Annotated[list[Literal["acoustics", "hearts"]], BeforeValidator(_preset_list)] = Field(default=[])
    """Keys that are drawn beside those in `keys`: one or both. `hearts`: size, shape, fibres, muscle, load and disease,
    over ranges in which hearts of all species are usable (docs/cases.md); use it with `loop.kind: circulation`.
    `acoustics`: levels of tissues, noise and artefacts, attenuation, gain and grey map, and the pose of each view
    (`angle_deg`, `offset`, `motion`), each over its published or chosen range (docs/realism.md), so that the looks of a
    training set differ; use it with a `realism.preset`."""
    number: Annotated[int, Field(ge=1, le=MAX_CASES)]
    """Number of hearts (of each row of the table and each combination of the grid). A larger number adds hearts, and
    those that were there stay; a power of 2 is the most even."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Seed of the draws, points of Sobol's sequence; it is not that of the images."""
    keys: Annotated[dict[str, Distribution], Field(min_length=1, max_length=MAX_KEYS)]
    """Distribution of each dotted key. Not needed with a `preset`; keys given here take precedence over its."""

    @model_validator(mode="before")
    @classmethod
    def _add_preset(cls, values: Any) -> Any:
        if not isinstance(values, dict) or not isinstance(keys := values.get("keys", {}), dict):
            return values
        presets = {key: drawn for name in presets_of(values) for key, drawn in DRAW_PRESETS[name].items()}
        return values | {"keys": presets | keys} if presets else values


class Cases(Section):
    """The hearts. Dotted keys with lists of values make a grid: all combinations. The grid, the rows of a table and the
    draws multiply, 100 000 hearts at most; conditions then leave out some of them (docs/cases.md)."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(init=False)

    file: str | None = None
    """CSV file with a row for each heart: columns of dotted keys, `case` (id), `label.NAME` and `note`. An empty cell
    has the value of the configuration."""
    table: str | None = None
    """Text of such a file, instead of `file`. The configuration that a run stores with a repository has it, so that the
    file is not needed again."""
    draw: Draw | None = None
    """Hearts drawn at random: each has one value of every key in `keys`."""
    where: Annotated[
        list[str],
        BeforeValidator(_as_list),
        Field(max_length=100),
        WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
    ] = Field(default=[])
    """Conditions that all hearts must meet, such as `loop.esv_uL < 0.6 * loop.edv_uL`."""

    @property
    def grid(self) -> dict[str, list[Any]]:
        """Dotted key -> its values."""
        return dict(self.__pydantic_extra__ or {})

    @property
    def rows(self) -> pd.DataFrame | None:
        """Rows of the table, if there is one, as :func:`echotruth.config.table.parse` gives them."""
        return None if self.table is None else parse(self.table)

    @property
    def keys(self) -> list[str]:
        """All dotted keys that differ between the hearts, or may."""
        rows, draw = self.rows, self.draw
        return list(dict.fromkeys([*(() if rows is None else swept(rows)), *self.grid, *(draw.keys if draw else ())]))

    @property
    def shape(self) -> list[int]:
        """Number of rows, values of each key of the grid, and draws, whose product is the number of hearts."""
        rows, draw = self.rows, self.draw
        lengths = [len(values) for values in self.grid.values()]
        return [*(() if rows is None else [len(rows)]), *lengths, *([draw.number] if draw else ())]

    @property
    def number(self) -> int:
        """Number of hearts before conditions leave out some."""
        return prod(self.shape)

    def __bool__(self) -> bool:
        """Whether there is a sweep at all."""
        return bool(self.grid or self.table is not None or self.draw or self.where)

    @model_validator(mode="before")
    @classmethod
    def _read_file(cls, values: Any) -> Any:
        """Read the file, so that the configuration is whole, wherever the file is later."""
        if not isinstance(values, dict) or not isinstance(path := values.get("file"), str):
            return values
        if "table" in values:
            raise invalid("file", path, "give either file or table and leave the other out")
        try:
            return values | {"table": read_text(Path(path), MAX_BYTES, "CSV file", "a table")}
        except ConfigError as error:
            raise invalid("file", path, str(error).partition(": ")[2] or "cannot be read") from None

    @check
    def _check_table(self) -> None:
        key, shown = ("table", self.table) if self.file is None else ("file", self.file)
        if self.table is None:
            return
        if len(self.table.encode()) > MAX_BYTES:
            raise invalid(key, shown, f"must have at most {MAX_BYTES // 2**20} MiB: give fewer rows or columns")
        try:
            parse(self.table)
        except TableError as error:
            raise invalid(key, shown, str(error)) from None

    @model_serializer(mode="wrap")
    def _given(self, handler: Any) -> dict[str, Any]:
        """What is given; the text of the table in place of its file."""
        values = {key: value for key, value in handler(self).items() if value not in (None, [])}
        if self.table is not None:
            values.pop("file", None)
        return values

"""What is generated from the models: the JSON schema and the tables of keys and arrays.

    python -m echotruth.reference

writes config/schema.json, config/README.md and docs/schema.md below the current folder.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from echotruth.config import Config
from echotruth.repository import schema
from echotruth.section import UNITS, Section, chooser, kinds, unit_of

_HEAD = """# Configuration

A configuration is a YAML file; every key not given takes its default. Unknown keys
and impossible values are refused before anything runs. `schema.json` beside this page lets
editors complete and check the YAML. Units are in the keys.

This page is generated from `src/echotruth/config` by `make reference`.

"""

_TREE = """# The tree on disk

One Zarr hierarchy, format 3, that `xarray.open_datatree` reads by itself. Every array is rectangular over
case, view and frame; a shard is what one job wrote, a chunk one frame of it, with a crc32c checksum.
Sizes of `SIZE` are the image sizes of the configuration (512, 256, 128 px). `nan`, 0 and "" stand where
there is nothing: outside the wall, or in the row of a case that failed (`cases/status`).
Axes, signs and reference states are in `conventions.md`.

The root carries the attributes title, summary, references, config (the whole configuration), seed, code (version of
each stage's source) and packages (their versions). Coordinates stand in every group whose arrays have their dimension.

Beside the repository lie `cases.csv` (the same table as the group `cases`), `registry.txt` (row of every case),
`ledger/` (a record for every finished job: checksums, seed, time taken), `figures/` and `logs/`.

This page is generated from `src/echotruth/repository/schema.py` by `make reference`.

"""

_RF = """The group is there where `rf.keep` asks for it, and holds `lines`, `channels` or both. Its attributes are, in
SI units, sampling_frequency (of the channels), demodulation_frequency (of the lines), sound_speed, centre_frequency,
bandwidth, element_width, element_height, elevation_focus, attenuation (nepers per metre and hertz); transmit, scan,
apodization and f_number, as in the section `rf`; foci (ranges of those of focused transmits, of which number `zone` x
lines + `line` serves that line in that zone); accuracy (how far the RF may be off the exact sum, relative) and
accuracy_from (the range from which on that holds).
"""


def table() -> str:
    """The page of keys: unit, default and meaning of each."""
    return _HEAD + "\n".join(_section(Config, "", "Top level"))


def tree() -> str:
    """The page of arrays: group by group."""
    parts = [_TREE]
    cases = "One more array for every key of the configuration that a case could vary, named and measured as the key.\n"
    sized = {f"{name}/SIZE": arrays for name, arrays in schema.SIZED.items()}
    groups = {"cases": schema.CASES} | schema.STAGES | schema.ASKED | sized
    notes = {"cases": cases, "rf": _RF}
    for path, arrays in groups.items():
        parts += [f"## {path}\n", *_arrays(arrays), notes.get(path, "")]
    return "\n".join([*parts, "## Coordinates\n", *_arrays(schema.COORDINATES)])


def json_schema() -> str:
    """The JSON schema of a configuration."""
    return json.dumps(Config.model_json_schema(), indent=1) + "\n"


def files() -> dict[str, str]:
    """Path of each generated file to its text."""
    return {"config/schema.json": json_schema(), "config/README.md": table(), "docs/schema.md": tree()}


def _arrays(arrays: tuple[schema.Array, ...]) -> list[str]:
    rows = [
        f"| `{array.name}` | {', '.join(array.dims)} | {array.dtype} | {array.units} | {array.long_name} |"
        for array in arrays
    ]
    return ["| array | dimensions | type | units | what |", "|---|---|---|---|---|", *rows, ""]


def _section(model: type[BaseModel], prefix: str, title: str, meaning: str = "") -> list[str]:
    lines = [f"## {title}\n"]
    if prefix:
        lines += [f"{meaning or ' '.join((model.__doc__ or '').split())}\n"]
    lines += ["| key | unit | default | meaning |", "|---|---|---|---|"]
    inner: list[str] = []
    for key, field in model.model_fields.items():
        mapping = get_origin(field.annotation) is dict
        choices = kinds(field.annotation)
        for kind, each in choices.items():
            path = f"{prefix}{key}.NAME." if mapping else f"{prefix}{key}."
            inner += _section(each, path, f"{path.removesuffix('.')}, {chooser(choices)} {kind}")
        if choices and not mapping:
            continue
        section = None if choices else _inner(field)
        if section is None or mapping:
            lines.append(f"| `{prefix}{key}` | {_unit(key)} | {_default(field)} | {_meaning(field)} |")
        if section is not None:
            path = f"{prefix}{key}.NAME." if mapping else f"{prefix}{key}."
            inner += _section(section, path, path.removesuffix("."), "" if mapping else _meaning(field))
    return [*lines, "", *inner]


def _inner(field: FieldInfo) -> type[Section] | None:
    for annotation in (field.annotation, *get_args(field.annotation)):
        if isinstance(annotation, type) and issubclass(annotation, Section):
            return annotation
    return None


def _unit(key: str) -> str:
    unit = unit_of(key)
    return unit.replace("_per_", "/").replace("per_", "1/") if unit in UNITS else ""


def _default(field: FieldInfo) -> str:
    default: Any = field.get_default(call_default_factory=True)
    if default is PydanticUndefined:
        return ""
    if isinstance(default, dict):
        return ", ".join(f"`{name}`" for name in default) or "none"
    return "`null`" if default is None else f"`{json.dumps(default)}`"


def _meaning(field: FieldInfo) -> str:
    return " ".join((field.description or "").split())


if __name__ == "__main__":
    for name, text in files().items():
        Path(name).write_text(text, encoding="utf-8")

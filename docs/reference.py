"""Generate the JSON schema and the tables of keys and arrays from the models.

    python docs/reference.py

writes config/schema.json, config/README.md and docs/schema.md in the current folder, a checkout.
"""

from __future__ import annotations

import json
from math import log2
from pathlib import Path
from typing import Any, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from echotruth.config import Config
from echotruth.repository import schema
from echotruth.section import discriminator, meaning, section_in, shown_unit, variants

_CONFIG_HEAD = """# Configuration

A configuration is a YAML file. A key that it leaves out has the default that is listed here; a
key without a default must be given where its section is used. Unknown keys and invalid values
are refused before anything runs. With `schema.json` in this folder,
editors complete and check the YAML. The keys carry their units.

This page is generated from `src/echotruth/config` by `make reference`.

"""

_SCHEMA_HEAD = """# The tree on disk

The repository is one Zarr hierarchy (format 3) that `xarray.open_datatree` opens. Every array is rectangular over
case, view and frame; one job writes a shard, and a chunk is one component of one frame (of what was tracked: of the
whole cycle) with a crc32c checksum. Numbers are compressed by Blosc (zstd, bytes shuffled).
`SIZE` stands for each image size of the configuration (512, 256, 128 px) and `TRACKER` for each tracker, as in
`evaluation/512/bspline_dic`. Missing values are `nan`, 0 or "": outside the wall, and in the row of a case that failed
(`cases/status`).
Axes, signs and reference states are in `conventions.md`.

Arrays with a **step** hold ordinary numbers rounded to multiples of it, so that they take less place: they are off by
half a step at most, and the attribute `quantum` has the step in the unit of the array. `pixel/256` is the largest power
of two, in metres, not above 1/256 pixel of the largest image. Scores are computed from the rounded numbers: whoever
reads the truth and the tracked motion finds the same.

A **pack** is one array of many small numbers, with a label for each, such as `nrmse[0,total]`, and its unit beside it:
`tree["evaluation/512/dis/scores"].sel(score="nrmse[0,total]")`. `echotruth.unpack(group.to_dataset(), "nrmse")`, of the
group `tree["evaluation/512/dis"]`, gives the array itself, with the dimensions that are listed under its pack.

The root has the attributes title, summary, references, config (the whole configuration), seed, code (version of
each stage's source) and packages (their versions). Every group has the coordinates of its dimensions, and the
attribute `labels` (dimension -> labels) for readers that cannot read arrays of strings; the labels of `case`, in the
order of the rows, are in that of the group `cases` only.

Cases and views keep their place for good: new ones are appended, whatever their order in the configuration, and those
that leave it stay, a case as `retired`. Find them by their labels.

The folder of the repository also contains `config.yaml`, `cases.csv` (the present cases with labels and all keys) and
`cases/CASE.json` (the configuration of each), `registry.txt` (row of every case) and `views.txt` (index of every view),
`ledger/STAGE/CASE/VIEW/SIZE.json` (a record of every finished job, without what the stage does not have: status,
checksums, seed, code; `structure.json`: checksums of all other files of the tree), `benchmarks/` (time and memory of
every job), `figures/` and `logs/`; and `external/` what `echotruth evaluate` found of other trackers: their scores
(NAME.csv) and, with `--keep`, NAME.zarr, which has their groups of tracking and evaluation, in the same rows.

This page is generated from `src/echotruth/repository/arrays.csv` by `make reference`.

"""

_RF = """The group exists if `rf.keep` is not empty, and contains `lines`, `channels` or both. Its attributes are, in
SI units, sampling_frequency (of the channels), demodulation_frequency (of the lines), sound_speed, centre_frequency,
bandwidth, element_width, element_height, elevation_focus, attenuation (nepers per metre and hertz); transmit, scan,
apodization and f_number, as in the section `rf`; foci (ranges of the foci of focused transmits; transmit number `zone`
x lines + `line` belongs to that line and zone); accuracy (largest error of the RF relative to the exact sum) and
accuracy_from (range from which that holds). Of these, those that differ among the cases are left out: the group `cases`
has the keys that they follow from.
"""


_DERIVED = """What follows from the stored arrays is not stored. `echotruth.kinematics(heart)` gives the arrays
below, for a heart that `echotruth.Repository.heart` reads or `echotruth.beat` makes. `echotruth.Repository.tracks`
gives, at the points of the trackers, the strain of a tracked motion by the operator of `tracking.md`, and their layer
and segment.
"""


def config_page() -> str:
    """Page of the configuration keys: unit, default and meaning of each."""
    return _CONFIG_HEAD + "\n".join(_section(Config, "", "Top level"))


def schema_page() -> str:
    """Page of the arrays, group by group."""
    parts = [_SCHEMA_HEAD]
    cases = (
        "One more array for `seed` and for every key that differs among the cases, with the key's name and unit, and\n"
        "likewise for `diagnosis`, `label.NAME` and `note` (docs/cases.md). The attribute `constants` holds what does\n"
        "not differ; `echotruth.Repository.tree` gives the table with all of them.\n"
    )
    notes = {"cases": cases, "rf": _RF}
    for path, arrays in ({"cases": schema.CASES} | schema.KINDS).items():
        parts += [f"## {path}\n", *_arrays(arrays), notes.get(path, "")]
        for pack in schema.PACKS.get(path, ()):
            parts += [f"### In the pack {path}/{pack.array.name}\n", *_arrays(pack.members)]
    parts += ["## Coordinates\n", *_arrays(schema.COORDINATES)]
    return "\n".join([*parts, "## Computed on reading\n", _DERIVED, *_arrays(schema.DERIVED)])


def files() -> dict[str, str]:
    """Path of each generated file -> its text."""
    schema_text = json.dumps(Config.model_json_schema(), indent=1) + "\n"
    return {"config/schema.json": schema_text, "config/README.md": config_page(), "docs/schema.md": schema_page()}


def _arrays(arrays: tuple[schema.Array, ...]) -> list[str]:
    rows = [
        f"| `{array.name}` | {', '.join(array.dims)} | {array.dtype} | {array.units} | {_step(array)} "
        f"| {array.long_name} |"
        for array in arrays
    ]
    return ["| array | dimensions | type | units | step | meaning |", "|---|---|---|---|---|---|", *rows, ""]


def _step(array: schema.Array) -> str:
    """Step of the numbers of an array; empty if they are not rounded."""
    if isinstance(array.quantum, float):
        return f"2^{round(log2(array.quantum))}"
    return array.quantum or ""


def _section(model: type[BaseModel], prefix: str, title: str, about: str = "") -> list[str]:
    lines = [f"## {title}\n"]
    if prefix:
        lines += [f"{about or ' '.join((model.__doc__ or '').split())}\n"]
    rows: list[str] = []
    subsections: list[str] = []
    for key, field in model.model_fields.items():
        mapping = get_origin(field.annotation) is dict
        path = f"{prefix}{key}.NAME." if mapping else f"{prefix}{key}."
        sections = variants(field.annotation)
        for name, variant in sections.items():
            subsections += _section(variant, path, f"{path.removesuffix('.')}, {discriminator(sections)} {name}")
        if sections and not mapping:
            continue
        subsection = None if sections else section_in(field.annotation)
        if subsection is None or mapping:
            rows.append(f"| `{prefix}{key}` | {shown_unit(key)} | {_default(field)} | {meaning(model, key)} |")
        if subsection is not None:
            subsections += _section(subsection, path, path.removesuffix("."), "" if mapping else meaning(model, key))
    if rows:
        lines += ["| key | unit | default | meaning |", "|---|---|---|---|", *rows, ""]
    return [*lines, *subsections]


def _default(field: FieldInfo) -> str:
    default: Any = field.get_default(call_default_factory=True)
    if default is PydanticUndefined:
        return ""
    if isinstance(default, dict):
        return ", ".join(f"`{name}`" for name in default) or "none"
    return "`null`" if default is None else f"`{json.dumps(default)}`"


if __name__ == "__main__":
    for name, text in files().items():
        Path(name).write_text(text, encoding="utf-8")

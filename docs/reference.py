"""Generate the JSON schema and the tables of keys and arrays from the models.

    python docs/reference.py

writes config/schema.json, config/README.md and docs/schema.md in the current folder, a checkout.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from math import log2
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from echotruth.config import Config
from echotruth.repository import schema
from echotruth.repository.array import Array
from echotruth.section import discriminator, docstrings, section_in, variants

_CONFIG_HEAD = """# Configuration

A configuration is a YAML file. A key that it leaves out has the default that is listed here; a
key without a default must be given where its section is used. Units are part of the keys (`per_s` is
1/s). Unknown keys and invalid values are refused before anything runs. With `schema.json` in this
folder, editors complete and check the YAML. The path in `cases.file` is from the folder of the
configuration that names it; all others are from the folder in which the command is run.

This page is generated from `src/echotruth/config` by `make reference`.

"""

_SCHEMA_HEAD = """# The tree on disk

A repository is one Zarr hierarchy (format 3). Each job writes one group of it:

```text
out/NAME/NAME.zarr/
  hearts/HEART/             a solved heart                               job of the rule
    geometry/                 mesh                                         mechanics
    fibres/                   fibres, sheets, layers, AHA segments         mechanics
    pathology/                infarct, late activation                     mechanics
    mechanics/                pressure, volume, tension, displacement      mechanics
    kinematics/               strain                                       mechanics
    physiology/               measures, such as twist and GLS              mechanics
  clips/CASE/VIEW/          a case seen in a view, a slice or volumes
    phantom/                  plane, scatterers                            phantom
    rf/                       lines; channels if rf.keep has them          rf
    truth/SIZE/               motion, strain and labels of every pixel     truth
    bmode/SIZE/               images                                       bmode
    points/                   true motion of the points that are tracked   points
    tracking/TRACKER/         what a tracker finds, its scores, all sizes  tracking
  inference/CASE/           if inference.tracker names a tracker         inference
    posterior/ prior/ observed_data/ posterior_predictive/ constant_data/ fit/
```

`HEART` and `CASE` are ids of `cases.csv`; `VIEW`, `SIZE` (512, 256, 128 px) and `TRACKER` are those of the
configuration. Of volumes `SIZE` is `volume`, and `rf`, `points` and `tracking/TRACKER` have other arrays. Cases that
differ only in speckle, array or image have one heart. `xarray.open_datatree` opens all of it, and `xarray.open_zarr` a
heart, a clip or a group; `echotruth.Repository` reads it by case, view and size.

Files beside it, in `out/NAME`: `config.yaml`, `cases.csv` (the cases with status, heart, labels and all keys),
`cases/CASE.json` (the configuration of each), `SHA256SUMS` (checksum of every file), `report.html` and `figures/`,
`logs/` and `benchmarks/` (time and memory of every job), `drafts/` (what jobs are writing), `inference.csv` (what was
inferred), `trackers.yaml` (settings of the trackers that `echotruth evaluate` added), and `export/` (what `echotruth
export` wrote).

- **Attributes of a group:** `status` (complete; failed: the heart has no solution; skipped: the heart is not
  imaged), `reason` (why it is not complete; then it has no arrays), `version` (a hash of the settings and the code
  that made it), and `checksums` (the SHA-256 of its files). A heart has `bounded` (its measures that have bounds), and
  a tracker `settings` and `failures` (image size -> why it failed). The root has title, summary, references, config
  (the whole configuration), seed and packages (their versions).
- **Consolidated metadata** of all that is below are in the root (of up to 50 000 groups and arrays), and in each heart
  and clip. **Coordinates** lie beside the arrays that have their dimensions.
- **Chunks.** An array is one shard, and a chunk is one component of one frame (of what was tracked: of the whole
  cycle) with a crc32c checksum. Small arrays are one chunk. Numbers are compressed by Blosc (zstd, bytes shuffled).
- **Missing values** are `nan`, 0 or "": outside the wall, and where a tracker has no estimate.
- **Steps.** Arrays with a step hold ordinary numbers rounded to multiples of it, the attribute `quantum` in the unit of
  the array. `pixel/256` is the largest power of two, in metres, not above 1/256 pixel of the largest image, or of the
  shortest side of a voxel. Scores are computed from the rounded numbers.

Axes, signs and reference states are in `conventions.md`.

This page is generated from `src/echotruth/repository/arrays.csv` by `make reference`.

"""

_RF = """`lines` are rounded to 16 bits of the largest. The group has `channels` and `channels_step` if `rf.keep` names
channels. Its attributes are, in SI units, sampling_frequency (of the channels), demodulation_frequency (of the lines),
sound_speed, centre_frequency, bandwidth, element_width, element_height, elevation_focus, attenuation (nepers per metre
and hertz); transmit, scan, apodization, transmit_apodization, harmonic and f_number, as in the section `rf`; foci
(ranges of the foci of focused transmits; transmit number `zone` x lines + `line` belongs to that line and zone); and
accuracy (largest error of the RF relative to the exact sum).
"""

_SCORES = """The array `scores` of a tracker holds these numbers one after another, for each image size. The coordinate
`score` labels them by name and place, as `nrmse 0 total`, and `score_units` has their units. `et.Repository.scores`
and `.metrics()` read them as tables.
"""

_DERIVED = """What follows from the stored arrays is not stored. `echotruth.kinematics(heart)` gives the arrays
below, for a heart that `echotruth.Repository.heart` reads or `echotruth.beat` makes. `echotruth.Repository.tracks`
gives, at the points of the trackers, the strain of a tracked motion
([tracked strain](conventions.md#tracked-strain)), and their layer and segment.
"""


def config_page() -> str:
    """Page of the configuration keys: default and meaning of each."""
    return _CONFIG_HEAD + "\n".join(_section(Config, "", "Top level"))


def schema_page() -> str:
    """Page of the arrays, group by group."""
    parts = [_SCHEMA_HEAD]
    for path, arrays in schema.KINDS.items():
        parts += [f"## {path}\n", *_arrays(arrays), *([_RF] if path == "rf" else [])]
        if path == "tracking/TRACKER":
            parts += ["### Scores\n", _SCORES, *_arrays(schema.SCORES.values())]
    parts += ["## Coordinates\n", *_arrays(schema.COORDINATES.values())]
    return "\n".join([*parts, "## Computed on reading\n", _DERIVED, *_arrays(schema.DERIVED)])


def files() -> dict[str, str]:
    """Path of each generated file -> its text."""
    schema_text = json.dumps(Config.model_json_schema(), indent=1) + "\n"
    return {"config/schema.json": schema_text, "config/README.md": config_page(), "docs/schema.md": schema_page()}


def _arrays(arrays: Iterable[Array]) -> list[str]:
    rows = [
        f"| `{array.name}` | {', '.join(array.dims)} | {array.dtype}{_step(array)} | {array.units} "
        f"| {array.long_name} |"
        for array in arrays
    ]
    return ["| array | dimensions | type (step) | units | meaning |", "|---|---|---|---|---|", *rows, ""]


def _step(array: Array) -> str:
    """Step of the numbers of an array, in brackets; empty if they are not rounded."""
    step = f"2^{round(log2(array.quantum))}" if isinstance(array.quantum, float) else array.quantum
    return f" ({step})" if step else ""


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
            meaning = _meaning(model, key)
            rows.append(f"| `{prefix}{key}` | {_default(field)} | {meaning}{_choice(field.annotation, meaning)} |")
        if subsection is not None:
            subsections += _section(subsection, path, path.removesuffix("."), "" if mapping else _meaning(model, key))
    if rows:
        lines += ["| key | default | meaning |", "|---|---|---|", *rows, ""]
    return [*lines, *subsections]


def _meaning(model: type[BaseModel], key: str) -> str:
    """What a key means, in one line."""
    return " ".join((model.model_fields[key].description or docstrings(model).get(key, "")).split())


def _choice(annotation: Any, meaning: str) -> str:
    """Sentence with the values that a key may have, if they are listed and its meaning does not name them all."""
    names = [f"`{value}`" for value in _values(annotation)]
    return f" One of {', '.join(names)}." if len(names) > 1 and any(name not in meaning for name in names) else ""


def _values(annotation: Any) -> list[Any]:
    """Values in the Literal of an annotation; none without one."""
    inner = get_args(annotation)
    return list(inner) if get_origin(annotation) is Literal else [value for each in inner for value in _values(each)]


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

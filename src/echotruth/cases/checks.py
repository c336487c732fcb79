"""Checks of a sweep: its keys, that all hearts differ, and the files that they name."""

import re
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from echotruth.cases.case import Case, Combination
from echotruth.cases.ids import exact
from echotruth.cases.rows import source_of
from echotruth.config import Config, Section
from echotruth.config.loading import ConfigError
from echotruth.config.reading import Errors
from echotruth.config.table import LABEL, labels, swept
from echotruth.section import dotted_values, value_of

NOT_SWEPT = (
    *("name", "cases", "views", "tracking", "inference", "geometry.shape", "fibres.layers", "loop.frames"),
    *("rf.keep", "bmode.field_of_view_mm", "bmode.size_px", "bmode.downsampling", "volume", "pathology.preset"),
)
"""Keys that cannot be swept (nor can `geometry.*_elements`), because they set the sizes of arrays over all cases, or
defaults of other sections."""

_SWEPT_WITHIN = re.compile(r"views\.\w+\.(?!plane$)[\w.]+|tracking\.frame_step")
"""Keys that can be swept within those that cannot."""


def can_be_swept(key: str) -> bool:
    """Whether a dotted key may differ between the cases of a repository."""
    return bool(_SWEPT_WITHIN.fullmatch(key)) or not (key.startswith(NOT_SWEPT) or key.endswith("_elements"))


def check_keys(config: Config, source: str) -> None:
    """Check that all keys can be swept, and that each is swept in one place.

    Raises
    ------
    ConfigError
        With the keys that cannot.
    """
    rows, draw = config.cases.rows, config.cases.draw
    places = [(key, f"{source_of(config)}, column {key[:80]!r}") for key in ([] if rows is None else swept(rows))]
    places += [(key, f"cases.{key[:80]}") for key in config.cases.grid]
    places += [(key, f"cases.draw.keys.{key[:80]}") for key in (draw.keys if draw else ())]
    first: dict[str, str] = {}
    errors = Errors()
    for key, place in places:
        with errors.collecting():
            if (other := first.setdefault(key, place)) != place:
                raise ConfigError(f"{source}: {place}: {key} is swept by {other} too: give it in one of them")
            _check_swept_key(config, key, f"{source}: {place}")
    for key, values in config.cases.grid.items():
        texts = [exact(value) for value in values]
        for value in [value for number, value in enumerate(values) if texts[number] in texts[:number]][:1]:
            errors.messages.append(f"{source}: cases.{key} gives a value twice, {value}: list each value once")
    errors.raise_all(source)


def check_ids(hearts: list[tuple[Combination, Case]], source: str) -> None:
    """Check that no two cases have the same id, also for file systems that do not tell letters by their case."""
    known: dict[str, tuple[Combination, Case]] = {}
    for heart, case in hearts:
        other, first = known.setdefault(case.id.casefold(), (heart, case))
        if first is case:
            continue
        given = " and ".join(one.origin or str(one.parameters) for one in (other, heart))
        if first.id != case.id:
            ids = f"{first.id} and {case.id}"
            raise ConfigError(f"{source}: cases: {given} have ids that differ in capitals alone, {ids}: change one")
        rows = [re.sub(r"(^|, )draw \d+$", "", one.origin) for one in (other, heart)]
        remedy = "leave one of them out" + (", or give each an id in a column case" if rows[1] else "")
        if rows[0] == rows[1] and rows[0] != other.origin:
            remedy = "draw fewer hearts, or another key as well"
        raise ConfigError(f"{source}: cases: {given} are the same heart, {case.id}: {remedy}")


def check_files(hearts: list[tuple[Combination, Case]], source: str) -> None:
    """Check that the files which the cases name are there; each is looked at once.

    Raises
    ------
    ConfigError
        With the row that names the file, if it is in a table.
    """
    _check_loops(hearts, source)
    known: set[str | None] = {None}
    for motion, place, _ in _distinct(hearts, "motion", source):
        if motion.kind == "file" and motion.file.path not in known:
            known.add(motion.file.path)
            _check_series(motion.file.path, place)
    for geometry, place, heart in _distinct(hearts, "geometry", source):
        if geometry.file and "geometry.file" in heart.parameters and not geometry.remesh:
            where = place if heart.origin else f"{source}: cases.geometry.file"
            raise ConfigError(f"{where}: the meshes may differ in size: set geometry.remesh: true")
        if geometry.file not in known and not Path(str(geometry.file)).is_file():
            remedy = f"there is no file {Path(str(geometry.file)).absolute()}: give its path from the working folder"
            raise ConfigError(f"{place}: geometry.file = {geometry.file!r}: {remedy}")
        known.add(geometry.file)


def check_condition_key(config: Config, key: str, place: str) -> None:
    """Check that a key of a condition is one of the configuration, or a label of the table."""
    rows = config.cases.rows
    if rows is not None and key in labels(rows):
        return
    if key.startswith(LABEL):
        raise ConfigError(f"{place}: {key} is not a column of the table: name one, or leave it out")
    if isinstance(_value_of(config, key, place), Section | dict):
        raise ConfigError(f"{place}: {key} is a section: name one of its keys")


def _check_swept_key(config: Config, key: str, place: str) -> None:
    value = _value_of(config, key, place)
    holds_sections = isinstance(value, dict) and any(isinstance(inner, Section) for inner in value.values())
    if isinstance(value, Section) or holds_sections:
        raise ConfigError(f"{place}: {key} is a section: sweep one of its keys")
    if not can_be_swept(key):
        raise ConfigError(f"{place}: {key} cannot be swept, all cases share it: set it once")


def _value_of(config: Config, key: str, place: str) -> Any:
    """Value of a dotted key without the sweep."""
    try:
        return value_of(config, key)
    except (KeyError, TypeError, ValueError):
        remedy = "write it in full, such as fibres.endo_deg"
        if "." not in key:
            remedy = f"write {LABEL}{key[:40]} if it is a label"
        if close := get_close_matches(key[:200], list(_all_keys(config)), n=1, cutoff=0.8):
            remedy = f"did you mean {close[0]}?"
        raise ConfigError(f"{place}: {key[:80]} is not a key: {remedy}") from None


def _all_keys(config: Config) -> Iterator[str]:
    yield from (key for key, _ in dotted_values(config) if key != "views")
    for name, view in config.views.items():
        yield from (key for key, _ in dotted_values(view, f"views.{name}."))


def _distinct(hearts: list[tuple[Combination, Case]], name: str, source: str) -> list[tuple[Any, str, Combination]]:
    """Each section of a name that occurs, its place for errors, and the first combination with it.

    Cases share the sections in which they do not differ. The place has the row too, if keys of the section are swept.
    """
    found: dict[int, tuple[Any, str, Combination]] = {}
    for heart, case in hearts:
        section = getattr(case.config, name)
        is_swept = heart.origin and any(key.startswith(f"{name}.") for key in heart.parameters)
        found.setdefault(id(section), (section, f"{source}: {heart.origin}" if is_swept else source, heart))
    return list(found.values())


def _check_loops(hearts: list[tuple[Combination, Case]], source: str) -> None:
    """Check each loop once for each size of heart."""
    from echotruth.loop.calibration import closed_valves
    from echotruth.loop.cycle import LoopError, check_filling, check_loop, read_loop, size

    known: set[tuple[str, float, float]] = set()
    for heart, case in hearts:
        loop, geometry = case.config.loop, case.config.geometry
        factor = size(case.config)
        found = loop.model_dump_json(exclude={"circulation"}), factor, geometry.cavity_uL()
        if found in known:
            continue
        known.add(found)
        try:
            if loop.kind == "circulation":
                closed_valves(read_loop(loop, factor))
            else:
                check_loop(loop, factor)
            if case.config.motion.kind == "beat" and not geometry.file:
                check_filling(case.config, geometry.cavity_uL() * 1e-9)
        except LoopError as error:
            is_swept = heart.origin and any(key.startswith(("loop.", "geometry.")) for key in heart.parameters)
            place = f"{source}: {heart.origin}" if is_swept else source
            raise ConfigError(f"{place}: loop: {str(error).removeprefix('loop.')}") from None


def _check_series(path: str | None, place: str) -> None:
    from echotruth.mechanics.motion_file.files import series_files
    from echotruth.mechanics.prescribed import MotionError

    try:
        series_files(str(path))
    except MotionError as error:
        raise ConfigError(f"{place}: {error}") from None

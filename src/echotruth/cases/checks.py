"""Checks of a sweep: its keys, that all hearts differ, and the files that they name."""

import re
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from echotruth.cases.case import Case, Combination
from echotruth.cases.ids import exact
from echotruth.cases.rows import source_of
from echotruth.config import Config, Section
from echotruth.config.loading import ConfigError
from echotruth.config.reading import Errors
from echotruth.config.table import LABEL
from echotruth.section import dotted_values, value_of

NOT_SWEPT = (
    *("name", "cases", "views", "tracking", "inference", "geometry.shape", "fibres.layers", "loop.frames"),
    *("rf.keep", "bmode.field_of_view_mm", "bmode.size_px", "bmode.downsampling"),
)
"""Keys that cannot be swept (nor can `geometry.*_elements`), because they set the sizes of arrays over all cases."""

_SWEPT_WITHIN = re.compile(r"views\.\w+\.(position|rotation_deg|tilt_deg)|tracking\.frame_step")
"""Keys that can be swept within those that cannot."""

RF_INDEPENDENT = {
    "probe.width_um": ("element_width",),
    "probe.height_mm": ("element_height", "accuracy_from"),
    "probe.elevation_focus_mm": ("elevation_focus", "accuracy_from"),
    "probe.attenuation_dB_per_cm_MHz": ("attenuation",),
}
"""Keys of the probe that can be swept even if RF is kept, because they change neither its length nor the scan lines,
and the attributes of the group `rf` that follow from them."""


def can_be_swept(key: str) -> bool:
    """Whether a dotted key may differ between the cases of a repository."""
    if _SWEPT_WITHIN.fullmatch(key):
        return True
    return not (key.startswith(NOT_SWEPT) or key.endswith("_elements"))


def check_keys(config: Config, source: str) -> None:
    """Check that all keys can be swept, and that each is swept in one place.

    Raises
    ------
    ConfigError
        With the keys that cannot.
    """
    places: dict[str, str] = {}
    errors = Errors()
    for key, place in _keys(config):
        with errors.collecting():
            if key in places:
                raise ConfigError(f"{source}: {place}: {key} is swept by {places[key]} too: give it in one of them")
            places[key] = place
            _check_swept_key(config, key, f"{source}: {place}")
    for key, values in config.cases.grid.items():
        with errors.collecting():
            _check_distinct(key, values, source)
    errors.raise_all(source)


def check_ids(hearts: list[tuple[Combination, Case]], source: str) -> None:
    """Check that no two cases have the same id, also for file systems that do not tell letters by their case."""
    known: dict[str, tuple[Combination, Case]] = {}
    for heart, case in hearts:
        other, first = known.setdefault(case.id.casefold(), (heart, case))
        if first is case:
            continue
        places = [one.origin or str(one.parameters) for one in (other, heart)]
        given = f"{places[0]} and {places[1]}"
        if first.id != case.id:
            ids = f"{first.id} and {case.id}"
            raise ConfigError(f"{source}: cases: {given} have ids that differ in capitals alone, {ids}: change one")
        remedy = _remedy_of_twins(other.origin, heart.origin)
        raise ConfigError(f"{source}: cases: {given} are the same heart, {case.id}: {remedy}")


def _remedy_of_twins(*origins: str) -> str:
    """What to do about two combinations that are the same heart, given where they come from."""
    rows = [re.sub(r"(^|, )draw \d+$", "", origin) for origin in origins]
    if rows[0] == rows[1] and rows[0] != origins[0]:
        return "draw fewer hearts, or another key as well"
    return "leave one of them out" + (", or give each an id in a column case" if rows[1] else "")


def check_files(hearts: list[tuple[Combination, Case]], source: str) -> None:
    """Check that the files which the cases name are there; each is looked at once.

    Raises
    ------
    ConfigError
        With the row that names the file, if it is in a table.
    """
    for loop, heart in _distinct(hearts, "loop"):
        _check_loop(loop, _place(heart, "loop.", source))
    series = set()
    for motion, heart in _distinct(hearts, "motion"):
        if motion.kind == "file" and motion.file.path not in series:
            series.add(motion.file.path)
            _check_series(motion.file.path, _place(heart, "motion.", source))
    meshes: set[str | None] = {None}
    for geometry, heart in _distinct(hearts, "geometry"):
        place = _place(heart, "geometry.", source)
        if geometry.file and "geometry.file" in heart.parameters and not geometry.remesh:
            where = place if heart.origin else f"{source}: cases.geometry.file"
            raise ConfigError(f"{where}: the meshes may differ in size: set geometry.remesh: true")
        if geometry.file not in {*meshes, *series} and not Path(str(geometry.file)).is_file():
            remedy = "file not found: give its path from this folder"
            raise ConfigError(f"{place}: geometry.file = {geometry.file!r}: {remedy}")
        meshes.add(geometry.file)


def check_condition_key(config: Config, key: str, table_labels: list[str], place: str) -> None:
    """Check that a key of a condition is one of the configuration, or a label of the table."""
    if key in table_labels:
        return
    if key.startswith(LABEL):
        raise ConfigError(f"{place}: {key} is not a column of the table: name one, or leave it out")
    value = _value_of(config, key, place)
    if isinstance(value, Section | dict):
        raise ConfigError(f"{place}: {key} is a section: name one of its keys")


def _keys(config: Config) -> Iterator[tuple[str, str]]:
    """Each swept key, and what errors call the place in which it is swept."""
    rows, draw = config.cases.rows, config.cases.draw
    yield from ((key, f"{source_of(config)}, column {key[:80]!r}") for key in (rows.keys if rows else ()))
    yield from ((key, f"cases.{key[:80]}") for key in config.cases.grid)
    yield from ((key, f"cases.draw.keys.{key[:80]}") for key in (draw.keys if draw else ()))


def _check_distinct(key: str, values: list[Any], source: str) -> None:
    seen: set[str] = set()
    for value in values:
        if (text := exact(value)) in seen:
            raise ConfigError(f"{source}: cases.{key} gives a value twice, {value}: list each value once")
        seen.add(text)


def _check_swept_key(config: Config, key: str, place: str) -> None:
    value = _value_of(config, key, place)
    holds_sections = isinstance(value, dict) and any(isinstance(inner, Section) for inner in value.values())
    if isinstance(value, Section) or holds_sections:
        raise ConfigError(f"{place}: {key} is a section: sweep one of its keys")
    if not can_be_swept(key):
        raise ConfigError(f"{place}: {key} cannot be swept, all cases share it: set it once")
    if config.rf.keep and key.startswith(("probe.", "rf.")) and key not in RF_INDEPENDENT:
        raise ConfigError(f"{place}: {key} cannot be swept if RF is kept: leave rf.keep empty")


def _value_of(config: Config, key: str, place: str) -> Any:
    """Value of a dotted key without the sweep."""
    try:
        return value_of(config, key)
    except (KeyError, TypeError, ValueError):
        raise ConfigError(f"{place}: {key[:80]} is not a key: {_suggestion(config, key)}") from None


def _suggestion(config: Config, key: str) -> str:
    close = get_close_matches(key[:200], list(_all_keys(config)), n=1, cutoff=0.8)
    if close:
        return f"did you mean {close[0]}?"
    return "write it in full, such as fibres.endo_deg" if "." in key else f"write {LABEL}{key[:40]} if it is a label"


def _all_keys(config: Config) -> Iterator[str]:
    for key, value in dotted_values(config):
        if key == "views":
            yield from (key for view, section in value.items() for key, _ in dotted_values(section, f"views.{view}."))
        else:
            yield key


def _distinct(hearts: Iterable[tuple[Combination, Case]], name: str) -> list[tuple[Any, Combination]]:
    """Each section that occurs, and the first combination with it; cases share those in which they do not differ."""
    found: dict[int, tuple[Any, Combination]] = {}
    for heart, case in hearts:
        section = getattr(case.config, name)
        found.setdefault(id(section), (section, heart))
    return list(found.values())


def _place(heart: Combination, prefix: str, source: str) -> str:
    """What errors name: the row too, if keys of a section are swept there."""
    swept = heart.origin and any(key.startswith(prefix) for key in heart.parameters)
    return f"{source}: {heart.origin}" if swept else source


def _check_loop(loop: Any, place: str) -> None:
    from echotruth.loop.circulation import calibrate
    from echotruth.loop.cycle import LoopError, check_loop, read_loop

    try:
        check_loop(loop)
        if loop.kind == "circulation":
            calibrate(read_loop(loop), loop.circulation)
    except LoopError as error:
        raise ConfigError(f"{place}: loop: {error}") from None


def _check_series(path: str | None, place: str) -> None:
    from echotruth.mechanics.motion_file.files import series_files
    from echotruth.mechanics.prescribed import MotionError

    try:
        series_files(str(path))
    except MotionError as error:
        raise ConfigError(f"{place}: {error}") from None

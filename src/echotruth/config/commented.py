"""A configuration written out with the meaning, unit, limits and default of its keys, from the models themselves."""

import re
import textwrap
from dataclasses import dataclass
from typing import Any

import yaml
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from echotruth.config.allowed import allowed
from echotruth.config.anatomy import HEART_PRESETS
from echotruth.config.loading import validate
from echotruth.section import Section, dotted_values, meaning, shown_unit

WIDTH = 110
"""Longest line of a comment."""

FIRST = (
    *("name", "seed", "geometry.preset", "geometry.endo_radius_mm", "geometry.endo_length_mm", "geometry.wall_mm"),
    *("geometry.circumferential_elements", "geometry.longitudinal_elements", "geometry.transmural_elements"),
    *("geometry.file", "fibres.endo_deg", "fibres.epi_deg", "pathology.infarct.segments", "loop.file"),
    *("loop.heart_rate_per_min", "loop.edv_uL", "loop.esv_uL", "loop.frames", "mechanics.material.stiffness_kPa"),
    *("motion.kind", "views", "probe.preset", "probe.elements", "rf.lines", "rf.focal_zones", "rf.keep"),
    *(
        "realism.preset",
        "realism.blood.level_dB",
        "realism.surroundings.level_dB",
        "realism.noise.snr_dB",
        "bmode.field_of_view_mm",
    ),
    *("bmode.size_px", "bmode.downsampling", "tracking.grid_px", "tracking.trackers", "cases"),
)
"""Keys that most people want to see first; what is said of them is in the models."""


@dataclass(frozen=True)
class Given:
    """A key that a text gives."""

    node: yaml.Node
    """Its value."""
    begin: int
    """Index of the end of the key in the text."""
    text: str
    """Its value as it is written, without the comment after it."""
    above: list[str]
    """Lines of comment above it."""
    beside: str
    """Comment after it; "" if there is none."""


def commented(text: str, everything: bool = False) -> str:
    """Configuration with comments, in which the keys that are not given are commented out or have their default.

    What begins with # and a letter is a key with its default: without the # it changes nothing.

    Parameters
    ----------
    text : str
        A valid configuration, whose comments are kept.
    everything : bool
        Whether all keys are written, rather than those that most people want to see first.

    Raises
    ------
    ConfigError
        If the configuration is not valid.
    """
    node = yaml.compose(text, Loader=yaml.SafeLoader)
    config = validate(yaml.safe_load(text) or {}, "configuration")
    writer = _Writer(text, everything)
    lines = writer.section(config, writer.given(node, 0), "", 0)
    return "\n".join(lines).strip() + "\n"


class _Writer:
    """Writes the keys of a text, and of those that it does not give all or the ones that most people want to see."""

    def __init__(self, text: str, everything: bool) -> None:
        self._text = text
        self._everything = everything
        self._following = _following()

    def section(self, section: Section, given: dict[str, Given], prefix: str, depth: int) -> list[str]:
        """Lines of the keys of a section at a depth, given what the text gives of each; `prefix` ends with a dot."""
        lines: list[str] = []
        for key in type(section).model_fields:
            block = self._key(section, key, given.get(key), f"{prefix}{key}", depth)
            lines += ["", *block] if block and lines and not depth else block
        # The keys of a grid of cases are not those of a model.
        for key in [key for key in given if key not in type(section).model_fields]:
            lines += [*_above(given[key], depth), *_raw(key, given[key], depth)]
        return lines

    def given(self, node: yaml.Node | None, begin: int) -> dict[str, Given]:
        """Key -> what the text gives of it, with the comments around it; those of the first key start at `begin`."""
        if not isinstance(node, yaml.MappingNode):
            return {}
        found, last = {}, begin
        for key_node, value_node in node.value:
            start, end = key_node.start_mark.index, _end(value_node)
            # The rest of a line belongs to the key before.
            lines = self._text[last:start].splitlines()[1 if last else 0 :]
            above = [line.strip() for line in lines if line.lstrip().startswith("#")]
            match = re.match(r"[ \t]*(#.*)", self._text[end:])
            text = self._text[value_node.start_mark.index : end]
            if isinstance(value_node, yaml.CollectionNode) and not value_node.flow_style:
                # With the comments above its first entry.
                text = self._text[key_node.end_mark.index : end].partition(":")[2].lstrip(" ")
            beside = match.group(1) if match and not node.flow_style else ""
            found[str(key_node.value)] = Given(value_node, key_node.end_mark.index, text, above, beside)
            last = end
        return found

    def _key(self, section: Section, key: str, entry: Given | None, dotted: str, depth: int) -> list[str]:
        """Lines of one key with what is said of it; none if it is left out."""
        value, info = getattr(section, key), type(section).model_fields[key]
        if isinstance(value, Section) and key != "cases":
            return self._subsection(value, meaning(type(section), key), entry, dotted, depth)
        if entry is None and not (self._everything or dotted in FIRST):
            return []
        above = _above(entry, depth)
        if above and dotted == "name":
            above.append("")  # the head of the file
        above += _indented(_explained(section, key, entry is None), depth)
        if entry is not None:
            return [*above, *_raw(key, entry, depth)]
        default = info.get_default(call_default_factory=True)
        if key not in section.model_fields_set and default is None:
            value = None  # what a preset fills in
        # A default that follows a preset would stay behind if it were written and the preset were changed.
        follows = dotted in self._following or value is None or value != default
        return [*above, *_written(key, value, depth, dotted in FIRST and not follows)]

    def _subsection(self, value: Section, about: str, entry: Given | None, dotted: str, depth: int) -> list[str]:
        """Lines of a section within a section; none if none of its keys is written."""
        given = self.given(entry.node, entry.begin) if entry else {}
        inner = self.section(value, given, f"{dotted}.", depth + 1)
        if not inner:
            return []
        about = about or " ".join((type(value).__doc__ or "").split())
        beside = f"    {entry.beside}" if entry and entry.beside else ""
        head = f"{'  ' * depth}{dotted.rpartition('.')[2]}:{beside}"
        return [*_above(entry, depth), *_indented(_wrapped(about), depth), head, *inner]


def _above(entry: Given | None, depth: int) -> list[str]:
    return _indented(entry.above, depth) if entry else []


def _raw(key: str, entry: Given, depth: int) -> list[str]:
    """A key as the text gives it, at its place."""
    first, *rest = entry.text.split("\n")
    inner = "  " * (depth + 1)
    shown = [f"{inner}{line}".rstrip() for line in textwrap.dedent("\n".join(rest)).splitlines()]
    lines = [f"{'  ' * depth}{key}: {first}".rstrip(), *shown]
    return [*lines[:-1], lines[-1] + (f"    {entry.beside}" if entry.beside else "")]


def _end(node: yaml.Node) -> int:
    """Index of the end of a value; that of a block ends with its last entry, without the comments below it."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return node.end_mark.index


def _following() -> set[str]:
    """Dotted keys whose default differs between the presets of the heart."""
    dumps = [dict(dotted_values(validate({"geometry": {"preset": name}}, name))) for name in HEART_PRESETS]
    return {key for key in dumps[0] if any(dump[key] != dumps[0][key] for dump in dumps)} - {"geometry.preset"}


def _explained(section: Section, key: str, is_default: bool) -> list[str]:
    """What a key means, its unit, what it may be, and its default."""
    info = type(section).model_fields[key]
    facts = [shown_unit(key), allowed(type(section), key), _default(section, key, info, is_default)]
    text = "; ".join(fact for fact in facts if fact)
    return [*_wrapped(meaning(type(section), key)), *_wrapped(f"[{text}]" if text else "")]


def _default(section: Section, key: str, info: FieldInfo, is_default: bool) -> str:
    """The default in words; if it follows from a preset, what it is here."""
    default, value = info.get_default(call_default_factory=True), getattr(section.resolved(), key)
    if default is PydanticUndefined or isinstance(default, dict | Section):
        return ""
    if is_default and value != default:
        return f"here {_yaml(value)}"
    return "" if default is None else f"default {_yaml(default)}"


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# ", break_long_words=False)


def _indented(lines: list[str], depth: int) -> list[str]:
    return [f"{'  ' * depth}{line}" for line in lines]


def _written(key: str, value: Any, depth: int, is_active: bool) -> list[str]:
    """A key and its value; a mapping of sections takes a line for each."""
    mark = "" if is_active else "#"
    inner = "  " * (depth + 1)
    if isinstance(value, dict) and value and all(isinstance(item, Section) for item in value.values()):
        entries = [f"{inner}{mark}{name}: {_yaml(_plain(item))}" for name, item in value.items()]
        return [f"{'  ' * depth}{mark}{key}:", *entries]
    return [f"{'  ' * depth}{mark}{key}: {_yaml(_plain(value))}"]


def _plain(value: Any) -> Any:
    if isinstance(value, Section):
        selector = {key: getattr(value, key) for key in ("method",) if key in type(value).model_fields}
        return selector | value.model_dump(exclude_unset=True)
    return list(value) if isinstance(value, tuple) else value


def _yaml(value: Any) -> str:
    """A value in one line of YAML; whole numbers without a decimal point."""
    value = list(value) if isinstance(value, tuple) else value
    text = yaml.safe_dump(value, default_flow_style=True, width=10**6, sort_keys=False).removesuffix("...\n").strip()
    return re.sub(r"(?<![\w.])(-?\d+)\.0(?![\w.])", r"\1", text)

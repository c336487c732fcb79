"""Read YAML files; what is malformed, or too large to be a configuration, is refused before it is expanded."""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from typing import Any

import yaml

MAX_BYTES = 4 * 2**20
"""Size of the largest file that is read: 100 000 values of 40 characters."""
MAX_DEPTH = 30
"""Largest depth of mappings and lists within each other; the deepest key of the configuration lies at 6."""
MAX_VALUES = 100_000
"""Largest number of values of a file, keys included, each counted as often as aliases repeat it."""


MAX_ERRORS = 20
"""Largest number of errors that are told at once."""


class ConfigError(ValueError):
    """Raised if a configuration cannot be run; each line of the message names file, key, value and remedy."""


class Errors:
    """Collects the errors of a configuration, so that all are told at once.

    Examples
    --------
    >>> errors = Errors()
    >>> for number in (1, 2):
    ...     with errors.collecting():
    ...         raise ConfigError(f"a.yaml: error {number}")
    >>> errors.raise_all("a.yaml")
    Traceback (most recent call last):
    ...
    echotruth.config.reading.ConfigError: a.yaml: error 1
    a.yaml: error 2
    """

    def __init__(self) -> None:
        self.lines: dict[str, None] = {}
        self.number = 0

    def add(self, message: str) -> None:
        """Keep an error; one that is known already is not told twice."""
        self.number += 1
        self.lines |= dict.fromkeys(message.splitlines())

    @contextmanager
    def collecting(self) -> Iterator[None]:
        """Keep the error that is raised within."""
        try:
            yield
        except ConfigError as error:
            self.add(str(error))

    @property
    def are_enough(self) -> bool:
        """Whether there are more than are told, or so many alike that a search for others takes long."""
        return len(self.lines) > MAX_ERRORS or self.number >= 10 * MAX_ERRORS

    def joined(self, source: str) -> ConfigError:
        """The errors as one, a line each.

        Parameters
        ----------
        source : str
            What the line names that says how many more there are.
        """
        lines = list(self.lines)
        if len(lines) > MAX_ERRORS:
            more = f"{source}: at least {len(lines) - MAX_ERRORS} more errors: correct these first"
            lines = [*lines[:MAX_ERRORS], more]
        return ConfigError("\n".join(lines))

    def raise_all(self, source: str) -> None:
        """Raise the errors as one, if there are any; `source` as in :meth:`joined`.

        Raises
        ------
        ConfigError
        """
        if self.lines:
            raise self.joined(source)


def read_yaml(path: Path) -> dict[str, Any]:
    """Read the mapping in a YAML file.

    Raises
    ------
    ConfigError
        If the file cannot be read, holds no mapping, or exceeds `MAX_BYTES`, `MAX_DEPTH` or `MAX_VALUES`.
    """
    text = read_text(path, MAX_BYTES, "YAML file", "a configuration")
    try:
        _check_events(text)
        values = yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise ConfigError(f"{path}{_sentence(error, len(text.splitlines()))}") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        kind = "text" if isinstance(values, str) else "a list" if isinstance(values, list) else "a single value"
        raise ConfigError(f"{path}: contains {kind}: write a mapping of keys to values")
    check_size(values, str(path))
    return values


def check_size(values: Any, source: str) -> None:
    """Check that values are no deeper and no more than those of a file may be.

    Lists that occur several times, as aliases make them, are counted each time; so whoever reads the values later does
    so in a bounded time.

    Parameters
    ----------
    values : dict
        Of a configuration.
    source : str
        Their file.

    Raises
    ------
    ConfigError
        With the key that holds too much.
    """
    count = 0
    for key, value in values.items():
        level = [value]
        for _ in range(MAX_DEPTH):
            level = list(islice(chain.from_iterable(map(_children, level)), MAX_VALUES + 1))
            count += len(level)
            if not level:
                break
            if count > MAX_VALUES:
                remedy = f"give at most {MAX_VALUES} values, each counted as often as its aliases repeat it"
                raise ConfigError(f"{source}: {shown_key([key])} holds too much: {remedy}")
        if level:
            raise ConfigError(f"{source}: {shown_key([key])} is nested too deeply: use at most {MAX_DEPTH} levels")


def shown_key(parts: list[Any]) -> str:
    """Dotted key in one line of at most 200 characters, whatever its text is."""
    text = ".".join(map(str, parts))
    shown = text if text.isprintable() else repr(text)[1:-1]
    return shown if len(shown) <= 200 else f"{shown[:197]}..."


def _children(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return chain(value, value.values())
    return value if isinstance(value, list | tuple) else ()


def read_text(path: Path, most: int, file: str, what: str) -> str:
    """Read a file of UTF-8 text.

    Parameters
    ----------
    path : Path
    most : int
        Size of the largest file that is read, bytes.
    file, what : str
        What it should be, for errors: "YAML file", "a configuration".

    Raises
    ------
    ConfigError
        If it is no file, cannot be read, is too large, or is not UTF-8.
    """
    # A pipe or a device could be read for ever.
    try:
        if path.exists() and not path.is_file():
            raise ConfigError(f"{path}: is not a file: give the path of a {file}")
        with path.open("rb") as opened:
            content = opened.read(most + 1)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}): give the path of a {file}") from None
    except ConfigError:
        raise
    except ValueError:
        raise ConfigError(f"{str(path)!r}: cannot be read: give the path of a {file}") from None
    if len(content) > most:
        size = path.stat().st_size / 2**20
        raise ConfigError(f"{path}: holds {size:.1f} MiB: {what} has at most {most // 2**20} MiB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text: give the path of a {file}") from None


_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""LibYAML is ten times as fast as PyYAML's own parser."""


class _Loader(_Base):
    """YAML loader of mappings with unique text or numbers as keys; a value that is not what its tag says is refused."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            value = super().construct_object(node, deep)
            if isinstance(value, int) and abs(value) >= 2**64:
                raise ValueError
            return value
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            kind = node.tag.removeprefix("tag:yaml.org,2002:")
            text = f"{str(node.value)[:40]!r}" if isinstance(node, yaml.ScalarNode) else "this"
            raise yaml.MarkedYAMLError(
                problem=f"{text} is not a valid {kind}: write a plain value", problem_mark=node.start_mark
            ) from error

    def construct_unique_mapping(self, node: yaml.Node) -> dict[Any, Any]:
        """Mapping whose keys are plain, each given once."""
        if not isinstance(node, yaml.MappingNode):
            raise TypeError
        values: dict[Any, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                problem = "a list or a mapping is used as a key: write the name of a key"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key_node.start_mark)
            if key_node.tag == "tag:yaml.org,2002:merge":
                problem = "<< would merge another mapping: write its keys out"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key_node.start_mark)
            key = self.construct_object(key_node, deep=True)
            if key in values:
                problem = f"key {shown_key([key])!r} is given twice: give it once"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key_node.start_mark)
            values[key] = self.construct_object(value_node, deep=True)
        return values

    def refuse_tag(self, node: yaml.Node) -> Any:
        """No key takes what other tags make."""
        problem = f"the tag {shown_key([node.tag.removeprefix('tag:yaml.org,2002:')])} is not read: leave it out"
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _Loader.construct_unique_mapping)
_Loader.add_constructor(None, _Loader.refuse_tag)
for _kind in ("binary", "omap", "pairs", "set", "timestamp"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.refuse_tag)
# A date without quotes is the text that it is in the file.
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if not tag.endswith(":timestamp")]
    for first, resolvers in _Base.yaml_implicit_resolvers.items()
}
SHORT_FLOAT = ("tag:yaml.org,2002:float", re.compile(r"[-+]?[0-9]+[eE][-+]?[0-9]+$"), list("-+0123456789"))
"""1e-6 is a number in YAML 1.2, but text in YAML 1.1, which PyYAML reads and writes."""
_Loader.add_implicit_resolver(*SHORT_FLOAT)


def _check_events(text: str) -> None:
    """Check the depth and the number of values from the sequence of events, before any value is made."""
    depth = count = 0
    event: Any
    for event in yaml.parse(text, Loader=_Loader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        count += isinstance(event, yaml.NodeEvent)
        if depth > MAX_DEPTH:
            problem = f"lists or mappings are nested too deeply: use at most {MAX_DEPTH} levels"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
        if count > MAX_VALUES:
            problem = f"the file holds too much: give at most {MAX_VALUES} values, keys included"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)


def _sentence(error: yaml.YAMLError, lines: int) -> str:
    """End of the sentence that begins with the path of a file of so many lines: line, problem and remedy."""
    if isinstance(error, yaml.reader.ReaderError):
        return ": holds a control character, which is not text: write plain UTF-8 text"
    mark: yaml.Mark | None = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or "is not YAML"
    line = f", line {min(mark.line + 1, lines)}" if mark else ""
    if ": " in problem:
        return f"{line}: {problem}"
    return f"{line}: {problem}: {_remedy(problem)}"


def _remedy(problem: str) -> str:
    if "start any token" in problem:
        return "indent by spaces, not tabs, and put text that begins with a special character in quotes"
    if "another document" in problem or "expected <document start>" in problem:
        return "write one document, without a second line of ---"
    if "recursive" in problem:
        return "an alias must not lie within its own anchor"
    return "correct the YAML"

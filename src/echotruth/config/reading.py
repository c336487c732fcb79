"""Read text and YAML files; what is malformed, or too large to be a configuration, is refused before it is expanded."""

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
"""Largest number of errors that are shown at once."""


class ConfigError(ValueError):
    """Raised if a configuration cannot be run; each line of the message names file, key, value and remedy."""


class Errors:
    """Collects the errors of a configuration, so that all are shown at once, each once.

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
        self.messages: list[str] = []

    @contextmanager
    def collecting(self) -> Iterator[None]:
        """Keep the error that is raised within."""
        try:
            yield
        except ConfigError as error:
            self.messages.append(str(error))

    @property
    def are_enough(self) -> bool:
        """Whether there are more than are shown, or so many alike that a search for others takes long."""
        return len(self.messages) >= 10 * MAX_ERRORS or len(set(self.messages)) > MAX_ERRORS

    def raise_all(self, source: str) -> None:
        """Raise what was kept, if there is anything, as :func:`joined`."""
        if self.messages:
            raise joined(self.messages, source)


def joined(messages: list[str], source: str) -> ConfigError:
    """The error with several messages, a line each; the last names the source if it says how many more there are."""
    lines = list(dict.fromkeys(chain.from_iterable(map(str.splitlines, messages))))
    if len(lines) > MAX_ERRORS:
        lines[MAX_ERRORS:] = [f"{source}: at least {len(lines) - MAX_ERRORS} more errors: correct these first"]
    return ConfigError("\n".join(lines))


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
    except (yaml.YAMLError, ValueError) as error:  # a number may be too long for Python
        raise ConfigError(f"{path}{_sentence(error, len(text.splitlines()))}") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        kind = "text" if isinstance(values, str) else "a list" if isinstance(values, list) else "a single value"
        raise ConfigError(f"{path}: contains {kind}: write a mapping of keys to values")
    check_size(values, str(path))
    return values


def check_size(values: dict[str, Any], source: str) -> None:
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
        level, depth = [value], 0
        while level and depth < MAX_DEPTH:
            level, depth = list(islice(chain.from_iterable(map(_children, level)), MAX_VALUES + 1)), depth + 1
            count += len(level)
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
    try:
        # A pipe or a device could be read for ever.
        if path.exists() and not path.is_file():
            problem = "is not a file"
        else:
            with path.open("rb") as opened:
                content = opened.read(most + 1)
            if len(content) <= most:
                return content.decode("utf-8-sig")
            problem = f"holds {path.stat().st_size / 2**20:.1f} MiB, and {what} at most {most // 2**20} MiB"
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
    except UnicodeDecodeError:
        problem = "is not UTF-8 text"
    except ValueError:  # a path that no file can have
        problem = "cannot be read"
    raise ConfigError(f"{path}: {problem}: give the path of a {file}")


_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""LibYAML is ten times as fast as PyYAML's own parser."""


class _Loader(_Base):
    """YAML loader of mappings in which each key is given once."""

    def construct_mapping(self, node: yaml.Node, deep: bool = False) -> dict[Any, Any]:
        values = super().construct_mapping(node, deep=True)
        if len(values) < len(node.value):
            names = [key.value for key, _ in node.value]
            key = next((key for n, (key, _) in enumerate(node.value) if key.value in names[:n]), node.value[0][0])
            problem = f"key {shown_key([key.value])!r} is given twice: give it once"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
        return values


# Dates, and the << of another mapping, are the text that they are in the file.
_KINDS = tuple(f"tag:yaml.org,2002:{kind}" for kind in ("null", "bool", "int", "float"))
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag in _KINDS]
    for first, resolvers in _Base.yaml_implicit_resolvers.items()
}
SHORT_FLOAT = ("tag:yaml.org,2002:float", re.compile(r"[-+]?[0-9]+[eE][-+]?[0-9]+$"), list("-+0123456789"))
"""1e-6 is a number in YAML 1.2, but text in YAML 1.1, which PyYAML reads and writes."""
_Loader.add_implicit_resolver(*SHORT_FLOAT)


def _check_events(text: str) -> None:
    """Check tags, depth and number of values from the sequence of events, before any value is made."""
    depth = count = 0
    event: Any
    for event in yaml.parse(text, Loader=_Loader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        count += isinstance(event, yaml.NodeEvent)
        problem = ""
        if depth > MAX_DEPTH:
            problem = f"lists or mappings are nested too deeply: use at most {MAX_DEPTH} levels"
        elif count > MAX_VALUES:
            problem = f"the file holds too much: give at most {MAX_VALUES} values, keys included"
        elif tag := getattr(event, "tag", None):
            problem = f"the tag {shown_key([tag.removeprefix('tag:yaml.org,2002:')])} is not read: leave it out"
        if problem:
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)


def _sentence(error: Exception, lines: int) -> str:
    """End of the sentence that begins with the path of a file of so many lines: line, problem and remedy."""
    mark: yaml.Mark | None = getattr(error, "problem_mark", None)
    problem: str = getattr(error, "problem", None) or f"is not YAML ({str(error).partition(chr(10))[0]})"
    line = f", line {min(mark.line + 1, lines)}" if mark else ""
    return f"{line}: {problem}" if ": " in problem else f"{line}: {problem}: correct the YAML"

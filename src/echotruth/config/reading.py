"""Read YAML files; what is malformed is refused in a sentence, and all errors of a configuration are told at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

MAX_BYTES = 4 * 2**20
"""Size of the largest file that is read: 100 000 values of 40 characters."""
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
        If the file cannot be read, holds no mapping, or exceeds `MAX_BYTES`.
    """
    text = read_text(path, MAX_BYTES, "YAML file", "a configuration")
    try:
        values = yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise ConfigError(f"{path}{_sentence(error, len(text.splitlines()))}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:  # a value that its tag is not
        raise ConfigError(f"{path}: cannot be read ({error}): correct the YAML") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        kind = "text" if isinstance(values, str) else "a list" if isinstance(values, list) else "a single value"
        raise ConfigError(f"{path}: contains {kind}: write a mapping of keys to values")
    return values


def shown_key(parts: list[Any]) -> str:
    """Dotted key in one line of at most 200 characters, whatever its text is."""
    text = ".".join(map(str, parts))
    shown = text if text.isprintable() else repr(text)[1:-1]
    return shown if len(shown) <= 200 else f"{shown[:197]}..."


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
    remedy = f"give the path of a {file}"
    try:
        if path.exists() and not path.is_file():  # a pipe could be read for ever
            raise ConfigError(f"{path}: is not a file: {remedy}")
        if (size := path.stat().st_size) > most:
            raise ConfigError(f"{path}: holds {size / 2**20:.1f} MiB: {what} has at most {most // 2**20} MiB")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}): {remedy}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text: {remedy}") from None


_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""LibYAML is ten times as fast as PyYAML's own parser."""


class _Loader(_Base):
    """YAML loader that refuses a key that is given twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        known = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in known:
                problem = f"key {shown_key([key.value])!r} is given twice: give it once"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
            known.add(str(key.value))
        return super().construct_mapping(node, deep)


# A date without quotes is the text that it is in the file.
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if not tag.endswith(":timestamp")]
    for first, resolvers in _Base.yaml_implicit_resolvers.items()
}


def _sentence(error: yaml.YAMLError, lines: int) -> str:
    """End of the sentence that begins with the path of a file of so many lines: line, problem and remedy."""
    if isinstance(error, yaml.reader.ReaderError):
        return ": holds a control character, which is not text: write plain UTF-8 text"
    mark: yaml.Mark | None = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or "is not YAML"
    line = f", line {min(mark.line + 1, lines)}" if mark else ""
    if ": " in problem:
        return f"{line}: {problem}"
    remedies = {
        "start any token": "indent by spaces, not tabs, and put text that begins with a special character in quotes",
        "document": "write one document, without a second line of ---",
    }
    remedy = next((remedy for said, remedy in remedies.items() if said in problem), "correct the YAML")
    return f"{line}: {problem}: {remedy}"

"""Configurations of the hearts; each combination of values within a section is validated once."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from echotruth.cases.case import Case, Combination
from echotruth.cases.ids import case_id, exact, extended_id
from echotruth.config import Cases, Config, Section
from echotruth.config.loading import ConfigError, override, replace_values


class Sweep:
    """Makes the cases of a configuration; each combination of values within a section is validated once.

    Parameters
    ----------
    config : Config
    source : str
        What errors name.
    """

    def __init__(self, config: Config, source: str) -> None:
        self.source = source
        self._config = config.model_copy(update={"cases": Cases()})
        self._values = {name: getattr(self._config, name) for name in type(config).model_fields}
        self._sections: dict[tuple[str, str], Any] = {}
        self._differing: dict[tuple[str, str], frozenset[str]] = {}

    def case(self, heart: Combination) -> Case:
        """The case with some values of the swept keys.

        Raises
        ------
        ConfigError
            If they are not valid together.
        """
        with self._explained(heart):
            sections = {name: self._section(name, keys) for name, keys in _by_section(heart.parameters).items()}
            config = Config.model_validate(self._values | sections)
            return Case(self.id(heart), heart.parameters, config, heart.labels, heart.note)

    def id(self, heart: Combination) -> str:
        """Id of the case with some values of the swept keys: given by its row, or a hash of the others that differ.

        Raises
        ------
        ConfigError
            If they are not valid.
        """
        if heart.given_id and heart.parameters.keys() <= heart.own:
            return heart.given_id
        sections = _by_section(heart.parameters).items()
        with self._explained(heart):
            differing = frozenset[str]().union(*(self._differing_keys(name, changes) for name, changes in sections))
        if heart.given_id:
            differing -= heart.own
        parameters = {key: value for key, value in heart.parameters.items() if key in differing}
        return extended_id(heart.given_id, parameters) if heart.given_id else case_id(parameters)

    def value(self, key: str, heart: Combination) -> Any:
        """Value of a dotted key in a case, with what follows from a preset; None if its law has no such key.

        A value that is swept need not be valid, so that a condition can leave out those that are not.

        Raises
        ------
        ConfigError
            If it follows from others that are not valid.
        """
        if heart.parameters.get(key) is not None:
            return heart.parameters[key]
        name, _, rest = key.partition(".")
        changes = _by_section(heart.parameters).get(name)
        with self._explained(heart):
            section = self._section(name, changes) if changes else self._values[name]
        try:
            return _value(section, rest) if rest else section
        except AttributeError:
            return None  # a parameter of another law

    @contextmanager
    def _explained(self, heart: Combination) -> Iterator[None]:
        """Raise the error of a combination that is not valid in terms of the keys as the user writes them."""
        try:
            yield
        except ValidationError:
            where = f"{self.source}: {heart.origin or 'cases'}"
            override(self._config, heart.parameters, where)
            raise ConfigError(f"{where}: {heart.parameters} are not valid together: leave them out") from None

    def _section(self, name: str, changes: dict[str, Any]) -> Any:
        """A section, or a key outside of sections, with some keys replaced."""
        known = (name, repr(changes))
        if known not in self._sections:
            base = self._values[name]
            is_section = isinstance(base, Section | dict)
            self._sections[known] = _replaced(base, changes) if is_section else changes[name]
        return self._sections[known]

    def _differing_keys(self, name: str, changes: dict[str, Any]) -> frozenset[str]:
        """Keys of a section whose value is not the one it would have if it were not swept.

        That is the value of the configuration, unless it follows other swept keys, as the parameters of a law and the
        lengths of a preset do.
        """
        known = (name, repr(changes))
        if known not in self._differing:
            base, section = self._values[name], self._section(name, changes)
            if isinstance(base, Section | dict):
                self._differing[known] = frozenset(key for key in changes if _differs(base, section, changes, key))
            else:
                self._differing[known] = frozenset(changes if exact(section) != exact(base) else ())
        return self._differing[known]


def _by_section(parameters: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Name of each swept section, or of a swept key outside of sections -> its dotted keys and their values."""
    by_section: dict[str, dict[str, Any]] = {}
    for key, value in parameters.items():
        by_section.setdefault(key.partition(".")[0], {})[key] = value
    return by_section


def _replaced(base: Any, changes: dict[str, Any]) -> Any:
    """Section, or mapping of names to sections, with the values of some dotted keys, named from the top, replaced."""
    keys = {key.partition(".")[2]: value for key, value in changes.items()}
    if isinstance(base, dict):
        return base | {name: _replaced(base[name], own) for name, own in _by_section(keys).items()}
    return type(base).model_validate(replace_values(base.given(), keys))


def _differs(base: Any, section: Any, changes: dict[str, Any], key: str) -> bool:
    others = {other: value for other, value in changes.items() if other != key}
    try:
        without, inner = _replaced(base, others) if others else base, key.partition(".")[2]
        return exact(_value(without, inner)) != exact(_value(section, inner))
    except (ValidationError, AttributeError, KeyError):
        return True  # without the key there is no such section


def _value(section: Any, dotted_key: str) -> Any:
    value = section
    for part in dotted_key.split("."):
        value = value[part] if isinstance(value, dict) else getattr(value.resolved(), part)
    return value.model_dump(mode="json") if isinstance(value, Section) else value

"""Configurations of the hearts; each combination of values within a section is validated once."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from echotruth.cases.case import Case, Combination
from echotruth.cases.ids import case_id, exact, extended_id
from echotruth.config import Cases, Config, Section
from echotruth.config.loading import ConfigError, override
from echotruth.config.merging import VALUES, merged, nested

Keys = dict[str, Any]
"""Dotted key -> value."""

MOTION = ("geometry.", "fibres.", "pathology.", "loop.", "mechanics.", "motion.")
"""Keys on which the motion of a heart depends."""


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
        self._known: dict[str, tuple[Any, frozenset[str]]] = {}

    def case(self, heart: Combination) -> Case:
        """The case with some values of the swept keys.

        Raises
        ------
        ConfigError
            If they are not valid together.
        """
        with self._explained(heart):
            sections = {name: self._swept(name, keys)[0] for name, keys in _by_section(heart.parameters).items()}
            config = Config.model_validate(self._values | sections)
            moving = {key: value for key, value in heart.parameters.items() if _moves(key, config)}
            own = case_id({key: moving[key] for key in moving if key in self._differing(moving)})
            return Case(self.id(heart), heart.parameters, config, heart.labels, heart.note, own)

    def id(self, heart: Combination) -> str:
        """Id of the case with some values of the swept keys: given by its row, or a hash of the others that differ.

        Raises
        ------
        ConfigError
            If they are not valid.
        """
        if heart.given_id and heart.parameters.keys() <= heart.own:
            return heart.given_id
        with self._explained(heart):
            differing = self._differing(heart.parameters)
        differing -= heart.own if heart.given_id else frozenset()
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
        name = key.partition(".")[0]
        with self._explained(heart):
            section, _ = self._swept(name, _by_section(heart.parameters).get(name, {}))
        try:
            return _value(section, key)
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

    def _swept(self, name: str, keys: Keys) -> tuple[Any, frozenset[str]]:
        """A section, or a key outside of sections, with some keys replaced, and those that make it another.

        Those are the keys whose value is not the one they would have if they were not swept: that of the
        configuration, unless it follows other swept keys, as the parameters of a law and the lengths of a preset do.
        """
        known = f"{name}: {keys!r}"
        if known not in self._known:
            section = self._replaced(name, keys)
            self._known[known] = section, frozenset(key for key in keys if self._differs(name, section, keys, key))
        return self._known[known]

    def _replaced(self, name: str, keys: Keys) -> Any:
        return _replaced(self._values[name], nested(keys)[name]) if keys else self._values[name]

    def _differs(self, name: str, section: Any, keys: Keys, key: str) -> bool:
        try:
            without = self._replaced(name, {other: value for other, value in keys.items() if other != key})
            return exact(_value(without, key)) != exact(_value(section, key))
        except (ValidationError, AttributeError, KeyError):
            return True  # without the key there is no such section

    def _differing(self, parameters: Keys) -> frozenset[str]:
        """Swept keys whose value is not the one it would have if it were not swept."""
        swept = [self._swept(name, keys)[1] for name, keys in _by_section(parameters).items()]
        return frozenset[str]().union(*swept)


def _moves(key: str, config: Config) -> bool:
    """Whether the motion of a heart depends on a key."""
    if key == "seed":
        return bool(config.fibres.disarray_deg)
    return key.startswith(MOTION) or (key == "rf.focus_mm" and config.motion.kind != "beat")


def _by_section(keys: Keys) -> dict[str, Keys]:
    """Name of each swept section, or of a swept key outside of sections -> its dotted keys and their values."""
    by_section: dict[str, Keys] = {}
    for key, value in keys.items():
        by_section.setdefault(key.partition(".")[0], {})[key] = value
    return by_section


def _replaced(base: Any, changes: Any) -> Any:
    """A section, or a mapping of names to sections, with changes laid over it; they are a key's value elsewhere."""
    if isinstance(base, Section):
        return type(base).model_validate(merged(base.given(), changes, VALUES))
    if isinstance(base, dict):
        return base | {name: _replaced(base[name], own) for name, own in changes.items()}
    return changes


def _value(section: Any, dotted_key: str) -> Any:
    """Value of a dotted key, whose first part names the section or is a key outside of sections."""
    value = section
    for part in dotted_key.split(".")[1:]:
        value = value[part] if isinstance(value, dict) else getattr(value.resolved(), part)
    return value.model_dump(mode="json") if isinstance(value, Section) else value

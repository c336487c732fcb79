"""Card of a tracker: who made it, where its code is, and what it had seen before it was scored."""

from __future__ import annotations

from datetime import date
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import Field, StringConstraints, ValidationError
from pydantic_core import ErrorDetails

from echotruth.benchmark.repositories import opened
from echotruth.config.loading import load
from echotruth.config.reading import ConfigError, read_yaml, shown_key
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.repository import durable
from echotruth.section import Name, Section, check, invalid, meaning

Text = Annotated[str, StringConstraints(min_length=1, max_length=300, pattern=r"^[^\n\r]*\S[^\n\r]*$")]
"""One line of text."""

Split = Literal["develop", "test"]
"""Half of the hearts."""


class Card(Section):
    """What a reader of the leaderboard must know of a tracker."""

    tracker: Name
    """Name under which it was scored, that of `external/NAME.csv`."""
    name: Text
    """Name of the method, as it is to be printed."""
    authors: Annotated[list[Text], Field(min_length=1, max_length=50)]
    """Who made it."""
    code: Text
    """Address of its code and the version that was scored, or the word closed."""
    trained_on: Text
    """Data from which its weights were learned, or the word nothing."""
    tuned_on: Text
    """Data on which its settings were chosen, or the word nothing."""
    splits_seen: Annotated[list[Split], Field(max_length=2)]
    """Halves of the hearts of this benchmark of which images or truth were used for any of this; [] if neither was."""
    date: Annotated[str, StringConstraints(pattern=r"^\d{4}-\d{2}-\d{2}$")]
    """Day on which it was scored, as 2026-11-23."""
    doi: Annotated[str, StringConstraints(pattern=r"^10\.\d{4,9}/\S+$", max_length=200)] | None = None
    """Of its publication, as 10.1000/182."""
    remark: Text | None = None
    """One sentence more."""

    @check
    def _check_date(self) -> None:
        try:
            date.fromisoformat(self.date)
        except ValueError:
            raise invalid("date", self.date, "must be a day of the calendar, as 2026-11-23") from None

    @check
    def _check_splits(self) -> None:
        if len(set(self.splits_seen)) < len(self.splits_seen):
            raise invalid("splits_seen", f"[{', '.join(self.splits_seen)}]", "must name each half once")

    @property
    def has_seen_test(self) -> bool:
        """Whether it used hearts on which it is scored."""
        return "test" in self.splits_seen


def read(path: Path) -> Card:
    """Read a card.

    Parameters
    ----------
    path : Path
        YAML file with the keys of :class:`Card`.

    Raises
    ------
    ConfigError
        With file, key, value and remedy, a line for each error.
    """
    values = read_yaml(path)
    try:
        return Card.model_validate(values)
    except ValidationError as error:
        lines = dict.fromkeys(f"{path}: {_message(each)}" for each in error.errors())
        raise ConfigError("\n".join(lines)) from None


def card_path(folder: Path, tracker: str) -> Path:
    """File of the card of a tracker that was evaluated on a repository: external/NAME.card.yaml."""
    return folder / "external" / f"{tracker}.card.yaml"


def attach(folder: Path, card: Card) -> Path:
    """Write the card of a tracker beside its scores.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    card : Card

    Returns
    -------
    Path
        The file.
    """
    path = card_path(folder, card.tracker)
    values = card.model_dump(mode="json", exclude_none=True)
    durable.write(path, yaml.safe_dump(values, sort_keys=False, allow_unicode=True, width=120).encode())
    return path


def attach_card(repositories: list[Path], path: Path) -> str:
    """Keep the card of a YAML file beside the scores of its tracker in every repository that has them; the files.

    ConfigError if it is no card, EvaluationError if none of the repositories has scores of its tracker.
    """
    card = read(path)
    folders = [opened(repository).folder for repository in repositories]
    scored = [folder for folder in folders if (folder / "external" / f"{card.tracker}.csv").is_file()]
    if not scored:
        if own := [folder for folder in folders if card.tracker in load(folder / "config.yaml").tracking.trackers]:
            remedy = f"is in the configuration of {own[0]}: only a tracker from outside has a card"
            raise EvaluationError(f"{path}: tracker = {card.tracker}: {remedy}")
        known = sorted({file.stem for folder in folders for file in (folder / "external").glob("[A-Za-z]*.csv")})
        remedy = f"use one of {', '.join(known)}" if known else "run echotruth evaluate --keep first"
        raise EvaluationError(f"{path}: tracker = {card.tracker}: was not evaluated: {remedy}")
    return ", ".join(str(attach(folder, card)) for folder in scored)


def card_of(folder: Path, tracker: str) -> Card | None:
    """Card of a tracker that was evaluated on a repository; None if it has none.

    Raises
    ------
    ConfigError
        If it is not a card.
    """
    path = card_path(folder, tracker)
    return read(path) if path.is_file() else None


_REMEDIES = {
    "missing": "is missing: it must be given",
    "string_type": "must be text",
    "too_short": "must have at least one entry",
    "string_too_short": "must not be empty",
}

_LISTS = {"authors": "[A. Author, B. Author]", "splits_seen": "[develop]"}
"""Examples of values that are lists."""


def _message(error: ErrorDetails) -> str:
    """One error: key, value and remedy."""
    keys = [str(part) for part in error["loc"]]
    context = error.get("ctx", {})
    if error["type"] == "invalid":
        return f"{context['key']} = {context['value']}: {context['remedy']}"
    key = shown_key(keys)
    if error["type"] == "extra_forbidden":
        known = list(Card.model_fields)
        close = get_close_matches(key, known, n=1)
        return f"{key} is not a key: " + (f"did you mean {close[0]}?" if close else f"use {', '.join(known)}")
    if error["type"] == "missing":
        return f"{key} {_REMEDIES['missing']}: {meaning(Card, str(keys[0]))}"
    if error["type"] == "list_type":
        remedy = f"must be a list, such as {_LISTS[key]}"
    elif key == "tracker" and error["type"] != "string_type":
        remedy = "use letters, digits and underscores, 40 at most and a letter first"
    elif error["type"] == "literal_error":
        remedy = f"use any of {context['expected'].replace(chr(39), '').replace(' or ', ' and ')}"
    elif error["type"] == "string_pattern_mismatch":
        described = meaning(Card, str(keys[0]))
        remedy = "must be one line of text" if context["pattern"].startswith("^[^") else f"write it so: {described}"
    else:
        remedy = _REMEDIES.get(error["type"], error["msg"])
    value = str(error["input"])
    return f"{key} = {value if len(value) <= 80 else f'{value[:77]}...'}: {remedy}"

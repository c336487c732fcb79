"""Card of a tracker: who made it, where its code is, and what it had seen before it was scored."""

from __future__ import annotations

from datetime import date
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import AfterValidator, Field, StringConstraints, ValidationError
from pydantic_core import ErrorDetails

from echotruth import files
from echotruth.config.loading import load
from echotruth.config.reading import ConfigError, read_yaml, shown_key
from echotruth.evaluation.tracker_options import EvaluationError
from echotruth.section import Name, Section, docstrings

from .repositories import opened

Text = Annotated[str, StringConstraints(min_length=1, max_length=300, pattern=r"^[^\n\r]*\S[^\n\r]*$")]
"""One line of text."""

Split = Literal["develop", "test"]
"""Half of the hearts."""


def _each_once(splits: list[str]) -> list[str]:
    if len(set(splits)) < len(splits):
        raise ValueError("a half is named twice")
    return splits


def _day(text: str) -> str:
    if date.fromisoformat(text).isoformat() != text:  # it takes other notations too, as 20261123
        raise ValueError("is written otherwise")
    return text


class Card(Section):
    """What a reader of the leaderboard must know of a tracker."""

    tracker: Name
    """Name under which it was scored, that of `external/NAME.csv`: letters, digits and underscores, 40
    at most and a letter first."""
    name: Text
    """Name of the method, as it is to be printed, in one line."""
    authors: Annotated[list[Text], Field(min_length=1, max_length=50)]
    """Who made it, a list such as [A. Author, B. Author]."""
    code: Text
    """Address of its code and the version that was scored, or the word closed, in one line."""
    trained_on: Text
    """Data from which its weights were learned, or the word nothing, in one line."""
    tuned_on: Text
    """Data on which its settings were chosen, or the word nothing, in one line."""
    splits_seen: Annotated[list[Split], AfterValidator(_each_once)]
    """Halves of the hearts of this benchmark of which images or truth were used for any of this, a list of develop and
    test, each once; [] if neither was."""
    date: Annotated[str, AfterValidator(_day)]
    """Day on which it was scored, as 2026-11-23."""
    doi: Annotated[str, StringConstraints(pattern=r"^10\.\d{4,9}/\S+$", max_length=200)] | None = None
    """Of its publication, as 10.1000/182."""
    remark: Text | None = None
    """One sentence more, in one line."""

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
    files.write(path, yaml.safe_dump(values, sort_keys=False, allow_unicode=True, width=120).encode())
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


def _message(error: ErrorDetails) -> str:
    """One error: key, value and what would be right."""
    key, keys = str(error["loc"][0]), list(Card.model_fields)
    if key not in keys:
        close = get_close_matches(key, keys, n=1)
        return f"{key} is not a key: " + (f"did you mean {close[0]}?" if close else f"use {', '.join(keys)}")
    right = " ".join(docstrings(Card)[key].split())
    if error["type"] == "missing":
        return f"{key} is missing: it must be given: {right}"
    value = " ".join(str(error["input"]).split())
    return f"{shown_key(list(error['loc']))} = {value if len(value) <= 80 else f'{value[:77]}...'}: must be so: {right}"

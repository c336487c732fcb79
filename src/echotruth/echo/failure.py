"""What is said of a clip or a wall that cannot be used."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FACTS = {"spacing_mm": "the side of its pixels", "frame_time_ms": "the time from frame to frame", "view": "its view"}
"""Options that say what a file may not, and what that is."""
FEWEST_FRAMES = 3
"""Frames of the shortest cycle: end-diastole, end-systole and one between or after."""


class EchoError(ValueError):
    """Raised if a clip or a wall cannot be used; the message names the file, what is wrong and what would be right."""


def unsaid(name: object, missing: list[str]) -> str:
    """Sentence that asks for all facts (keys of :data:`FACTS`) that a file does not say."""
    facts, options = ([*map(FACTS.get, missing)], missing)
    return f"{name}: does not say {_listed(facts)}: give {_listed(options)}"


def _listed(words: list[Any]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


@contextmanager
def reading(path: Path, fault: str) -> Iterator[None]:
    """Say what is wrong with a file, and what the library says of it, in place of whatever error that raises."""
    try:
        yield
    except EchoError:
        raise
    except Exception as error:  # most libraries have no common type for what is wrong with a file
        raise EchoError(f"{path}: is {fault}: {' '.join(str(error).split())[:200]}") from None

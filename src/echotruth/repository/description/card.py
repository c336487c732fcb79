"""README.md of a repository: its data card; its words are in README.md.jinja."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from echotruth.cases.labels import diagnosis
from echotruth.repository.description.citation import bibtex
from echotruth.repository.description.facts import Facts
from echotruth.repository.description.files import StoredFile
from echotruth.repository.description.statements import rendered
from echotruth.section import unit_of

MARK = "<!-- Made by echotruth describe. -->\n"
"""First line, by which the file is known as one that may be replaced."""

LISTED = 20
"""Hearts, failures and values that are listed one by one; the others are in the tables."""


def card(
    facts: Facts, said: dict[str, Any], made: list[StoredFile], release: Sequence[dict[str, Any]] | None = None
) -> bytes:
    """Data card of a repository.

    Parameters
    ----------
    facts : Facts
    said : dict
        Statements on the repository.
    made : list of StoredFile
        Tables that are written beside the card.
    release : sequence of dict, optional
        Parts in which the repository is given away, each with `part`, `bytes`, `sha256` and `holds`. Default: the card
        stands in the folder of the repository.
    """
    cases = facts.repository.cases
    parts: dict[str, list[int]] = {}
    for file in facts.files:
        parts.setdefault("/".join(file.path.split("/")[:2]), []).append(file.size)
    complete = [case for case, (status, _) in facts.outcomes.items() if status == "complete"]
    text = rendered(
        "README.md.jinja",
        LISTED=LISTED,
        facts=facts,
        said=said,
        size=sum(file.size for file in facts.files),
        example=[*complete, *cases][0],
        unit_of=unit_of,
        diagnoses=sorted(Counter(diagnosis(case.config) for case in cases.values()).items()),
        labels=list(dict.fromkeys(name for case in cases.values() for name in case.labels)),
        incomplete=[(case, *each) for case, each in facts.outcomes.items() if each[0] != "complete"],
        parts=sorted(parts.items()),
        release=release,
        beside=[*facts.tables, *made],
        bibtex=bibtex(facts, said["title"]),
    )
    return (text + "\n").encode()

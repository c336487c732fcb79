"""Documents by which others find, judge, read and cite a repository; one module for each."""

from __future__ import annotations

from itertools import starmap
from pathlib import Path

from echotruth.repository import durable
from echotruth.repository.description.attribution import Attribution, DescriptionError, attribution
from echotruth.repository.description.card import MARK as CARD_MARK
from echotruth.repository.description.card import card
from echotruth.repository.description.citation import MARK as CITATION_MARK
from echotruth.repository.description.citation import citation
from echotruth.repository.description.croissant import croissant
from echotruth.repository.description.facts import Facts, read_facts
from echotruth.repository.description.files import stored
from echotruth.repository.description.ro_crate import NAME as CRATE
from echotruth.repository.description.ro_crate import ro_crate, workflow_files
from echotruth.repository.description.tables import CHECKSUMS, CLIPS, checksums, clips

__all__ = ["Attribution", "DescriptionError", "attribution", "describe"]

MARKS = {"README.md": CARD_MARK, "CITATION.cff": CITATION_MARK}
"""Files that a user may have written -> first line of those that were made here."""


def describe(repository: Path, output: Path | None = None, given: Attribution | None = None) -> list[Path]:
    """Write the documents of a repository.

    The same repository, with the same times of its records, gives the same bytes.

    Parameters
    ----------
    repository : Path
        `out/NAME`.
    output : Path, optional
        Folder for the documents (default: that of the repository). They name files by their path in the repository.
    given : Attribution, optional
        Authors, licence, address.

    Returns
    -------
    list of Path
        The documents.

    Raises
    ------
    DescriptionError
        If the folder is no repository, is damaged or empty, or holds a README.md or CITATION.cff of somebody else.
    """
    given, output = given or Attribution(), output or repository
    try:
        _refuse_foreign_files(output)
        documents = _documents(read_facts(repository), given)
    except OSError as error:
        remedy = "make it readable"
        raise DescriptionError(f"{error.filename or repository}: cannot be read ({error.strerror}): {remedy}") from None
    try:
        durable.update_all({output / path: content for path, content in documents.items()})
    except OSError as error:
        raise DescriptionError(
            f"{output}: cannot be written ({error.strerror or error}): choose another --output"
        ) from None
    return [output / path for path in documents]


def _documents(facts: Facts, given: Attribution) -> dict[str, bytes]:
    """Content of all documents by their path; the later ones hold checksums of the earlier."""
    tables = {CLIPS: clips(facts), CHECKSUMS: checksums(facts)}
    texts = {"README.md": card(facts, given, tables), "CITATION.cff": citation(facts, given)}
    made = tables | texts
    made["croissant.json"] = croissant(facts, given, [*starmap(stored, made.items())], tables)
    made |= workflow_files()
    return made | {CRATE: ro_crate(facts, given, [*starmap(stored, made.items())])}


def _refuse_foreign_files(folder: Path) -> None:
    for name, mark in MARKS.items():
        path = folder / name
        if path.is_file() and not path.read_bytes().startswith(mark.encode()):
            raise DescriptionError(
                f"{path}: was not made by echotruth describe: move it away, or choose another --output"
            )

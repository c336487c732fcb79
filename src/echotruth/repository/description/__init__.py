"""Documents by which others find, judge, read and cite a repository; one module for each."""

from itertools import starmap
from pathlib import Path

from echotruth.repository import durable
from echotruth.repository.description.attribution import Attribution, DescriptionError, attribution
from echotruth.repository.description.card import MARK as CARD_MARK
from echotruth.repository.description.card import card
from echotruth.repository.description.citation import MARK as CITATION_MARK
from echotruth.repository.description.citation import citation
from echotruth.repository.description.facts import read_facts
from echotruth.repository.description.files import stored
from echotruth.repository.description.statements import statements
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
        If the folder is no repository, is damaged or empty, or holds a README.md or CITATION.cff of somebody else, or
        if a package is missing.
    """
    output = output or repository
    _refuse_foreign_files(output)
    documents = _documents(repository, given or Attribution())
    durable.update_all({output / path: content for path, content in documents.items()})
    return [output / path for path in documents]


def _documents(repository: Path, given: Attribution) -> dict[str, bytes]:
    """Content of all documents by their path; the later ones hold checksums of the earlier."""
    try:
        from echotruth.repository.description.croissant import croissant
        from echotruth.repository.description.ro_crate import NAME, ro_crate, workflow_files
    except ModuleNotFoundError as error:
        raise DescriptionError(
            f"describe needs the package {error.name}: pip install 'echotruth[description]'"
        ) from None
    facts = read_facts(repository, given)
    said = statements(facts)
    made = {CLIPS: clips(facts, said["columns"]), CHECKSUMS: checksums(facts)}
    made |= {"README.md": card(facts, said, [*starmap(stored, made.items())]), "CITATION.cff": citation(facts, said)}
    made["croissant.json"] = croissant(facts, said, [*starmap(stored, made.items())], made[CLIPS])
    made |= workflow_files()
    return made | {NAME: ro_crate(facts, said, [*starmap(stored, made.items())])}


def _refuse_foreign_files(folder: Path) -> None:
    for name, mark in MARKS.items():
        path = folder / name
        if path.is_file() and not path.read_bytes().startswith(mark.encode()):
            raise DescriptionError(
                f"{path}: was not made by echotruth describe: move it away, or choose another --output"
            )

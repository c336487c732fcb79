"""Documents by which others find, judge, read and cite a repository."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from echotruth import files
from echotruth.config import shipped
from echotruth.repository.reader import Repository
from echotruth.sharing.description import citation, statements
from echotruth.sharing.description.attribution import Attribution
from echotruth.sharing.description.facts import CLIPS, DescriptionError, Facts, read_facts

__all__ = ["DescriptionError", "describe", "documents"]


def describe(repository: Repository, output: Path | None = None, given: Attribution | None = None) -> list[Path]:
    """Write the documents of a finished repository; the same one, with the same times, gives the same bytes.

    Parameters
    ----------
    repository : Repository
    output : Path, optional
        Folder for the documents (default: that of the repository). They name files by their path in the repository.
    given : Attribution, optional
        Authors, licence, address.

    Raises
    ------
    DescriptionError
        If it is not finished, damaged, or holds a README.md or CITATION.cff of somebody else, if the folder is that of
        the sample, or a package is missing.
    """
    folder = output or repository.folder
    if shipped.is_sample(folder):
        remedy = "give another folder with --output"
        raise DescriptionError(f"{folder}: comes with the package and is not written to: {remedy}")
    facts = read_facts(repository, given or Attribution())
    for name, mark in {"README.md": statements.MARK, "CITATION.cff": citation.MARK}.items():
        if (folder / name).is_file() and not (folder / name).read_bytes().startswith(mark.encode()):
            remedy = "move it away, or choose another --output"
            raise DescriptionError(f"{folder / name}: was not made by echotruth describe: {remedy}")
    found = documents(facts, statements.statements(facts))
    for name, content in found.items():
        files.update(folder / name, content)
    return [folder / name for name in found]


def documents(facts: Facts, said: dict[str, Any], parts: Sequence[tuple[str, int, str]] = ()) -> dict[str, bytes]:
    """Documents by the names of their files; those of a release have parts: name, bytes and SHA-256 of each."""
    from echotruth.sharing.description.croissant import croissant

    return {
        CLIPS: facts.clips_table,
        "README.md": statements.card(facts, said, bool(parts)),
        "CITATION.cff": citation.citation(facts, said),
        "croissant.json": croissant(facts, said, parts),
    }

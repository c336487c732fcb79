"""A repository as the files that one would upload: parts with their checksums, a card, metadata and an evaluator."""

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import starmap
from pathlib import Path
from shutil import rmtree
from typing import Any

import yaml

from echotruth.release import evaluate
from echotruth.release.parts import Part, registry, table, write_parts
from echotruth.repository import durable
from echotruth.repository.check import check
from echotruth.repository.description.attribution import Attribution, DescriptionError
from echotruth.repository.description.card import card
from echotruth.repository.description.citation import PAPER, citation, filled
from echotruth.repository.description.facts import Facts, read_facts
from echotruth.repository.description.files import StoredFile, stored
from echotruth.repository.description.statements import statements
from echotruth.repository.description.tables import CLIPS, clips
from echotruth.repository.fetching import PARTS, REGISTRY
from echotruth.repository.reader import Repository

PART_BYTES = 2 * 10**9
"""Largest size of a part unless another is asked for."""
HUB_TASKS = ["image-segmentation", "keypoint-detection"]
"""What Hugging Face calls the tasks that the truth is for."""
HUB_SIZES = {1_000: "n<1K", 10_000: "1K<n<10K", 100_000: "10K<n<100K", 1_000_000: "100K<n<1M"}
"""Number of clips -> what Hugging Face calls fewer."""


Croissant = Callable[..., bytes]


class ReleaseError(ValueError):
    """Raised if a repository cannot be released; the message says why, and what to do."""


def release(
    repository: Repository, folder: Path, given: Attribution | None = None, part_bytes: int = PART_BYTES
) -> list[Path]:
    """Write the files of a release; the same repository, with the same times of its records, gives the same bytes.

    Parameters
    ----------
    repository : Repository
        Finished, in a folder.
    folder : Path
        Folder for the files, which is not there yet; it has its name only when all of them are written.
    given : Attribution, optional
        Authors, licence, address.
    part_bytes : int, optional
        Largest size of a part.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    ReleaseError, DescriptionError
        If the repository is not finished or is damaged, the folder is there already, or a package is missing.
    """
    if folder.exists() or folder.is_symlink():
        raise ReleaseError(f"{folder}: is there already: give another folder with --to, or remove it")
    croissant, facts = _croissant(), _facts(repository, given or Attribution())
    draft = folder.with_name(f".partial-{folder.name}")
    rmtree(draft, ignore_errors=True)
    draft.mkdir(parents=True)
    try:
        found = write_parts(repository, draft, part_bytes)
        texts = _documents(facts, found, croissant)
        texts[REGISTRY] = registry(found, texts)
        durable.update_all({draft / name: content for name, content in texts.items()})
        durable.sync(*(part.path for part in found))
        draft.rename(folder)
    except BaseException:
        rmtree(draft, ignore_errors=True)
        raise
    return [folder / name for name in (*(part.path.name for part in found), *texts)]


def _facts(repository: Repository, given: Attribution) -> Facts:
    """What is to be known of a repository that is finished and whole."""
    place = repository.folder
    facts = read_facts(place, given)
    if not facts.is_published:
        raise ReleaseError(f"{place}: is not finished: run its configuration to its end")
    if faults := check(place, quick=True).faults:
        raise ReleaseError(f"{place}: is damaged, first at {faults[0].path}: echotruth check {place} lists all faults")
    return replace(facts, tables=[file for file in facts.tables if file.path == "cases.csv"])


def _croissant() -> Croissant:
    """Function that writes croissant.json; DescriptionError if its package is missing."""
    try:
        from echotruth.repository.description.croissant import croissant
    except ModuleNotFoundError as error:
        remedy = "pip install 'echotruth[description]'"
        raise DescriptionError(f"release needs the package {error.name}: {remedy}") from None
    return croissant


def _documents(facts: Facts, found: list[Part], croissant: Croissant) -> dict[str, bytes]:
    """Content of the files beside the parts, by their names."""
    said, rows = statements(facts), [_row(part) for part in found]
    tables = {CLIPS: clips(facts, said["columns"]), PARTS: table(found)}
    made = [stored(CLIPS, tables[CLIPS])]
    archives = [StoredFile(row["part"], row["bytes"], row["sha256"]) for row in rows]
    hub = yaml.safe_dump(_hub(facts, said), sort_keys=False, allow_unicode=True)
    listed = [*starmap(stored, tables.items())]
    return tables | {
        "README.md": f"---\n{hub}---\n\n".encode() + card(facts, said, listed, rows),
        "CITATION.cff": citation(facts, said),
        "croissant.json": croissant(facts, said, made, tables[CLIPS], archives),
        ".zenodo.json": (json.dumps(_zenodo(facts, said), indent=1, ensure_ascii=False) + "\n").encode(),
        "cases.csv": (facts.repository.folder / "cases.csv").read_bytes(),
        "evaluate.py": Path(evaluate.__file__).read_bytes(),
    }


def _row(part: Part) -> dict[str, Any]:
    return {"part": part.path.name, "bytes": part.bytes, "sha256": part.sha256, "holds": part.holds}


def _hub(facts: Facts, said: dict[str, Any]) -> dict[str, Any]:
    """Head of the card, as Hugging Face reads it."""
    licence = facts.attribution.licence
    other = {"license": "other", "license_name": "custom", "license_link": licence.url} if licence.url else {}
    terms = {"license": licence.name.lower()} if licence.is_spdx else other
    number = sum(len(written) for written in facts.images.values())
    return filled(
        pretty_name=said["title"],
        **terms,
        language=["en"],
        tags=said["keywords"],
        task_categories=HUB_TASKS,
        size_categories=[next((name for size, name in HUB_SIZES.items() if number < size), "n>1M")],
        configs=[{"config_name": name, "data_files": f"{name}.csv"} for name in ("clips", "cases")],
    )


def _zenodo(facts: Facts, said: dict[str, Any]) -> dict[str, Any]:
    """What Zenodo asks for of a record."""
    attribution = facts.attribution
    people = [
        filled(
            name=f"{one.family}, {one.given}" if one.is_person else one.name,
            orcid=one.orcid,
            affiliation=one.affiliation,
        )
        for one in attribution.authors
    ]
    return filled(
        title=said["title"],
        upload_type="dataset",
        description=said["summary"],
        creators=people,
        license=attribution.licence.name.lower() if attribution.licence.is_spdx else "",
        access_right="open" if attribution.licence.is_spdx else "",
        version=attribution.release,
        publication_date=facts.published.isoformat(),
        language="eng",
        keywords=said["keywords"],
        related_identifiers=[{"identifier": PAPER["doi"], "relation": "cites"}] if PAPER.get("doi") else [],
    )


__all__ = ["PART_BYTES", "ReleaseError", "release"]

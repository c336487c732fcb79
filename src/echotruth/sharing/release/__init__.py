"""A repository as the files that one would upload: parts with their checksums, a card, a citation and tables."""

from pathlib import Path
from typing import Any

import yaml

from echotruth import files
from echotruth.repository.reader import Repository
from echotruth.sharing.export.destination import draft
from echotruth.sharing.fetching import PARTS, REGISTRY
from echotruth.sharing.release.attribution import Attribution
from echotruth.sharing.release.citation import citation, filled
from echotruth.sharing.release.facts import CLIPS, Facts, ReleaseError, read_facts
from echotruth.sharing.release.parts import Part, registry, table, write_parts
from echotruth.sharing.release.statements import card, statements

PART_BYTES = 2 * 10**9
"""Largest size of a part unless another is asked for."""
HUB_TASKS = ["image-segmentation", "keypoint-detection"]
"""What Hugging Face calls the tasks that the truth is for."""
HUB_SIZES = {1_000: "n<1K", 10_000: "1K<n<10K", 100_000: "10K<n<100K", 1_000_000: "100K<n<1M"}
"""Number of clips -> what Hugging Face calls fewer."""


def release(
    repository: Repository, folder: Path, given: Attribution | None = None, part_bytes: int = PART_BYTES
) -> list[Path]:
    """Write the files of a release; the same repository, with the same time of its checksums, gives the same bytes.

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
    ReleaseError
        If the repository is not finished or is damaged, or the folder is there already.
    """
    if folder.exists() or folder.is_symlink():
        raise ReleaseError(f"{folder}: is there already: give another folder with --to, or remove it")
    facts = read_facts(repository, given or Attribution())
    with draft(folder) as path:
        path.mkdir()
        found = write_parts(repository, path, part_bytes)
        texts = _documents(facts, found)
        texts[REGISTRY] = registry(found, texts)
        for name, content in texts.items():
            files.write(path / name, content)
    return [folder / name for name in (*(part.path.name for part in found), *texts)]


def _documents(facts: Facts, found: list[Part]) -> dict[str, bytes]:
    """Content of the files beside the parts, by their names."""
    said = statements(facts)
    hub = yaml.safe_dump(_hub(facts, said), sort_keys=False, allow_unicode=True)
    return {
        CLIPS: facts.clips_table,
        "CITATION.cff": citation(facts, said),
        PARTS: table(found),
        "README.md": f"---\n{hub}---\n\n".encode() + card(facts, said),
        "cases.csv": (facts.repository.folder / "cases.csv").read_bytes(),
    }


def _hub(facts: Facts, said: dict[str, Any]) -> dict[str, Any]:
    """Head of the card, as Hugging Face reads it."""
    given, number = facts.attribution, facts.clips_table.count(b"\n") - 1
    other = {"license": "other", "license_name": "custom", "license_link": given.terms} if given.terms else {}
    terms = {"license": given.spdx.lower()} if given.spdx else other
    return filled(
        pretty_name=facts.title,
        **terms,
        language=["en"],
        tags=said["keywords"],
        task_categories=HUB_TASKS,
        size_categories=[next((name for size, name in HUB_SIZES.items() if number < size), "n>1M")],
        configs=[{"config_name": name, "data_files": f"{name}.csv"} for name in ("clips", "cases")],
    )


__all__ = ["PART_BYTES", "ReleaseError", "release"]

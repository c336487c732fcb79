"""Cases that differ only in their images share one heart: it is solved once, and the others take over its files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.repository import durable, ledger, schema
from echotruth.repository.checksums import verify
from echotruth.workflow.failure import CaseFailed

if TYPE_CHECKING:
    from echotruth.workflow.job import Job, Result


def first_with_same(settings: dict[str, str], rows: dict[str, int]) -> dict[str, str]:
    """Case from which each other case takes over its motion.

    Parameters
    ----------
    settings : dict
        Case -> hash of what its motion depends on, in the order of the configuration.
    rows : dict
        Row of every case that is registered already. The first of equal cases is the one that was registered first, so
        that it stays the same if a value is added in front of others.

    Returns
    -------
    dict
        Case -> the first case with the same settings, for all cases that are not the first themselves.
    """
    first: dict[str, str] = {}
    for case in sorted(settings, key=lambda case: rows.get(case, len(rows))):
        first.setdefault(settings[case], case)
    return {case: first[value] for case, value in settings.items() if first[value] != case}


def take_over(job: Job) -> Result:
    """Take over the files of the mechanics of another case, that of `job.same_as`.

    They become names of the same data on disk where the file system can do that (hard links), else copies. A file of
    the store is replaced as a whole and never changed in place, so that what is written for one case later leaves the
    others as they are. Damage to the data of a link, however, is damage to all of them; every record has its checksums.

    Parameters
    ----------
    job : Job
        The job of the case that takes over.

    Returns
    -------
    dict
        Groups whose files now stand, without arrays: nothing is left to be written.

    Raises
    ------
    CaseFailed
        If the other case has no result.
    ChecksumError
        If a file of the other case is missing or differs from what its job wrote.
    """
    assert job.same_as is not None
    root, record = job.store.path, ledger.read(job.same_as)
    if record["status"] != "complete":
        raise CaseFailed(record["reason"])
    verify(root, job.same_as, record)
    job.withdraw()
    row = ledger.rows(job.folder / "registry.txt")[record["case"]]
    groups = schema.written_by(job.stage, job.config)
    folders: set[Path] = set()
    for group in groups:
        for file in job.store.files(group, row):
            array, chunks, _, *rest = file.relative_to(root / group).parts
            target = (root / group).joinpath(array, chunks, str(job.row), *rest)
            durable.link(file, target)
            folders |= set(target.parents[: len(rest) + 2])
    durable.sync(*folders)  # a folder holds the names of the files and folders in it
    job.note(bounded=record["bounded"], shared_with=record["case"])
    return {group: {} for group in groups}

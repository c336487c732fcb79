"""Hearts and clips of other repositories, copied to where a configuration wants them."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from echotruth import files
from echotruth.repository.check import check
from echotruth.repository.checksums import CHECKSUMS, METADATA
from echotruth.repository.group import ChecksumError
from echotruth.workflow.plan import Plan


def merge(plan: Plan, sources: Sequence[Path]) -> int:
    """Copy what a configuration asks for from other repositories; a run makes the rest, and what differs, anew.

    Parameters
    ----------
    plan : Plan
        Of the configuration that has the hearts of all.
    sources : sequence of Path
        Folders of repositories, `out/NAME`; of what several have, the first counts.

    Returns
    -------
    int
        Number of hearts, clips and inferences that were copied.

    Raises
    ------
    ChecksumError
        If a file of a repository is not what was written.
    """
    for folder in sources:
        if faults := check(folder, quick=True).faults:
            raise ChecksumError(
                f"{folder} is damaged, so that nothing is copied: {faults[0]} (echotruth check {folder})"
            )
    clips = [f"clips/{case}/{view}" for case in plan.cases for view in plan.config.views]
    places = [*(f"hearts/{heart}" for heart in plan.hearts), *clips, *(f"inference/{case}" for case in plan.cases)]
    copied = 0
    for place in places:
        found = [store / place for folder in sources for store in folder.glob("*.zarr") if (store / place).is_dir()]
        if found and _is_empty(plan.store / place):
            draft = plan.folder / "drafts" / "merged"
            shutil.rmtree(draft, ignore_errors=True)  # of a merge that was killed
            shutil.copytree(found[0], draft)
            if place.startswith("clips/"):
                (draft / METADATA).unlink(missing_ok=True)  # the rule repository writes it
            files.sync_all(draft)
            (plan.store / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.rmtree(plan.store / place, ignore_errors=True)
            draft.replace(plan.store / place)
            copied += 1
    if copied:
        (plan.folder / CHECKSUMS).unlink(missing_ok=True)  # so that the rule repository writes them
    return copied


def _is_empty(folder: Path) -> bool:
    """Whether a folder holds no array: it is not there, or has only the groups that are to hold what will be made."""
    return not any(folder.glob("**/c"))

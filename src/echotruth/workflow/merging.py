"""Hearts and clips of other repositories, copied to where a configuration wants them."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from echotruth.repository.places import METADATA
from echotruth.repository.publication import CHECKSUMS
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
    """
    clips = [f"clips/{case}/{view}" for case in plan.cases for view in plan.config.views]
    places = [*(f"hearts/{heart}" for heart in plan.hearts), *clips, *(f"inference/{case}" for case in plan.cases)]
    copied = 0
    for place in places:
        found = [store / place for folder in sources for store in folder.glob("*.zarr") if (store / place).is_dir()]
        if found and not (plan.store / place).exists():
            draft = plan.folder / "drafts" / "merged"
            shutil.rmtree(draft, ignore_errors=True)  # of a merge that was killed
            shutil.copytree(found[0], draft)
            if place.startswith("clips/"):
                (draft / METADATA).unlink(missing_ok=True)  # the rule repository writes it
            (plan.store / place).parent.mkdir(parents=True, exist_ok=True)
            draft.replace(plan.store / place)
            copied += 1
    if copied:
        (plan.folder / CHECKSUMS).unlink(missing_ok=True)  # so that the rule repository writes them
    return copied

"""The command `echotruth merge`: hearts of repositories of the same settings in one."""

import os
import subprocess
import sys
from itertools import combinations
from pathlib import Path
from uuid import uuid4

from echotruth.cases import expand
from echotruth.config import Config
from echotruth.repository import ledger
from echotruth.repository.checksums import ChecksumError
from echotruth.repository.inventory import CheckError, Inventory, JobRecord
from echotruth.repository.layout import lay_out
from echotruth.repository.merge import MergeError, check_sources, compare, spanning, take_over, verify_files
from echotruth.repository.publication import publish
from echotruth.workflow import lease
from echotruth.workflow.snakemake_process import snakemake_command

BATCH = 5000
"""Largest number of records on one command line."""


def merge_repositories(into: Path, sources: list[Path]) -> int:
    """Take over the hearts of repositories into another, lay it out for all of them, and publish it if it is complete.

    Parameters
    ----------
    into : Path
        Folder of the repository that receives them; made if need be.
    sources : list of Path
        Folders of the others, which stay as they are.

    Returns
    -------
    int
        0, or 2 if they cannot be merged; nothing is changed then.
    """
    try:
        if into.resolve() in [source.resolve() for source in sources]:
            raise MergeError(f"{into}: is merged with itself: name it once")
        folders = [*([] if _is_only_begun(into) else [into]), *sources]
        config = spanning(into.resolve().name, check_sources(folders))
        for earlier, later in combinations(folders, 2):
            compare(later, earlier)
        for source in sources:
            verify_files(source)
        held = lease.acquire(into, uuid4().hex, wait=False)
        try:
            _merge(into, sources, config, held.holder.run)
        finally:
            held.release()
    except (MergeError, CheckError, ChecksumError, OSError) as error:
        print(f"echotruth: {error}", file=sys.stderr)
        return 2
    return 0


def _is_only_begun(into: Path) -> bool:
    """Whether a folder is not there, or has no more than a merge leaves that was killed before its configuration."""
    begun = {"registry.txt", "views.txt", "ledger", "cases", "cases.csv", f"{into.resolve().name}.zarr"}
    return not into.exists() or all(path.name in begun or path.name.startswith(".") for path in into.iterdir())


def _merge(into: Path, sources: list[Path], config: Config, run: str) -> None:
    lay_out(into, config, expand(config, into.name))
    all_taken: list[JobRecord] = []
    for source in sources:
        taken, known = take_over(source, into)
        all_taken += taken
        print(f"{source}: {len(taken)} jobs taken over" + (f", {known} known already" if known else ""))
    _introduce(into, all_taken, run)
    missing = [path for path in Inventory(into).wanted() if not path.is_file()]
    if missing:
        print(f"{into}: {len(missing)} jobs of the joint sweep were not made in either: echotruth run makes them")
    else:
        ledger.commit(into / "ledger/repository.json", publish(into))
        print(f"{into}: published")


def _introduce(into: Path, taken: list[JobRecord], run: str) -> None:
    """Let Snakemake know the settings of the jobs that were taken over, so that it runs them again if these change.

    It keeps them in its working folder, in which `out/NAME` is the repository; elsewhere nothing is done.
    """
    if into.resolve() != (Path("out") / into.resolve().name).resolve():
        return
    paths = [str(Path("out", into.resolve().name, record.path.relative_to(into))) for record in taken]
    # Times stay in order: what a job depends on is touched before it.
    command = snakemake_command(into / "config.yaml", ["--cores", "1", "--touch", "--forceall"])
    for first in range(0, len(paths), BATCH):
        batch, environment = paths[first : first + BATCH], os.environ | {lease.VARIABLE: run}
        told = subprocess.run([*command, *batch], env=environment, capture_output=True, text=True, check=False)
        if told.returncode:
            why = (told.stdout + told.stderr)[-500:]
            raise MergeError(f"{into}: Snakemake could not be told of the merged hearts: {why}")

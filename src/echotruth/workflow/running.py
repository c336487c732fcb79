"""The Snakemakes of a run: one for every block of hearts that is not made yet, then one for repository and report."""

from collections.abc import Iterator
from math import ceil
from pathlib import Path

from echotruth.config import Config
from echotruth.repository.ledger import stages
from echotruth.workflow.jobs import TARGETS, ended, jobs
from echotruth.workflow.plan import Plan
from echotruth.workflow.snakemake_process import Snakemake


class Running:
    """The Snakemakes of a run.

    A sweep that fits in one block, or of which single files are to be made, is one Snakemake. In a larger one, a block
    whose mark and records are there is not planned again.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`, which is laid out.
    config : Config
    command : list of str
        Command of Snakemake, without the block.
    targets : list of str
        Rules and files that are to be made; empty for all.
    hearts_per_block : int
    """

    def __init__(
        self, folder: Path, config: Config, command: list[str], targets: list[str], hearts_per_block: int
    ) -> None:
        self._folder, self._command, self._targets = folder, command, targets
        self._plan = Plan(config.model_dump(), config.name)
        self._count = ceil(len(self._plan.cases) / hearts_per_block) if {*targets} <= {*TARGETS} else 1

    def hearts(self) -> Iterator[Snakemake]:
        """Snakemakes of the blocks that are not made, if there are several."""
        for number in range(1, self._count + 1 if self._count > 1 else 0):
            plan = self._plan.block(number, self._count)
            if plan.cases and not plan.stands():
                plan.mark.unlink(missing_ok=True)  # or Snakemake would not make a record that is lost
                yield self._snakemake(number, ["hearts"])

    def end(self) -> Iterator[Snakemake]:
        """Snakemake of repository and report; of all, if there is one block."""
        yield self._snakemake(1 if self._count == 1 else 0, self._targets)

    def waiting(self) -> dict[str, int]:
        """Rule -> number of its jobs without a record, if there are several blocks: the last ones are planned late."""
        cases, config = self._plan.cases, self._plan.config
        rules = stages(config) if self._count > 1 else ()
        return {rule: len(jobs(rule, config, cases) - ended(self._folder, rule, config)) for rule in rules}

    def _snakemake(self, number: int, targets: list[str]) -> Snakemake:
        name = "snakemake" if self._count == 1 else f"snakemake_{number:0{len(str(self._count))}}"
        block = ["--config", f"block={number}/{self._count}", "--", *targets]
        return Snakemake([*self._command, *block], self._folder / f"logs/{name}.log")

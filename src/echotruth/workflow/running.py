"""The Snakemakes of a run: one for every block of hearts that is not made yet, then one for repository and report."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil
from pathlib import Path

from echotruth.config import Config
from echotruth.workflow.execution import Snakemake
from echotruth.workflow.plan import Plan


class Running:
    """The Snakemakes of a run.

    A sweep that fits in one block is one Snakemake. In a larger one, a block whose mark and records are there is not
    planned again.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`, which is laid out.
    config : Config
    command : list of str
        Command of Snakemake, without the block.
    hearts_per_block : int
    """

    def __init__(self, folder: Path, config: Config, command: list[str], hearts_per_block: int) -> None:
        self._folder, self._command, self._made_any = folder, command, False
        self._plan = Plan(config.model_dump(), config.name)
        self._count = ceil(len(self._plan.cases) / hearts_per_block)

    def hearts(self) -> Iterator[Snakemake]:
        """Snakemakes of the blocks that are not made, if there are several."""
        for number in range(1, self._count + 1 if self._count > 1 else 0):
            plan = self._plan.block(number, self._count)
            if plan.cases and not plan.stands():
                plan.mark.unlink(missing_ok=True)  # or Snakemake would not make a record that is lost
                self._made_any = True
                yield self._snakemake(number, ["hearts"])

    def end(self) -> Iterator[Snakemake]:
        """Snakemake of repository and report; of all, if there is one block."""
        if self._count == 1:
            yield self._snakemake(1, [])
        else:
            yield self._snakemake(0, ["--forcerun", "repository"] if self._made_any else [])

    def _snakemake(self, number: int, options: list[str]) -> Snakemake:
        name = "snakemake" if self._count == 1 else f"snakemake_{number:0{len(str(self._count))}}"
        block = ["--config", f"block={number}/{self._count}"]
        return Snakemake([*self._command, *options, *block], self._folder / f"logs/{name}.log")

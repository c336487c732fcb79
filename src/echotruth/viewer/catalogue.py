"""What a repository has to show: its cases with their verdicts, its views, image sizes and trackers."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np

from echotruth.config import Config
from echotruth.evaluation import kept
from echotruth.learning.beams import Beams
from echotruth.learning.reading import Reader
from echotruth.learning.table import UNFINISHED

FINISHED = "complete"


class Catalogue:
    """Contents of a repository, read once; opening one takes as long as its lists of cases take to read.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    """

    def __init__(self, repository: str | Path) -> None:
        self.reader = Reader(repository)
        self.config: Config = self.reader.config
        self.rows, self.indices = self.reader.cases, self.reader.views
        self._status, self._reason = (self.reader.labels(f"cases/{name}") for name in ("status", "reason"))

    @cached_property
    def cases(self) -> list[str]:
        """Ids of the cases of the configuration, in the order of their rows."""
        return [case for case in self.rows if self.status(case) != "retired"]

    @cached_property
    def views(self) -> list[str]:
        """Views of the configuration that have a place in the store."""
        return [view for view in self.config.views if view in self.indices]

    @cached_property
    def sizes(self) -> list[int]:
        """Pixels along a side of the images, the largest first."""
        return list(self.config.bmode.sizes)

    @cached_property
    def trackers(self) -> list[str]:
        """Names of the trackers of the repository, and of those from outside of which the motion was kept."""
        return kept.trackers(self.reader.folder, self.config)

    @cached_property
    def own_trackers(self) -> list[str]:
        """Names of the trackers of the repository."""
        return list(self.config.tracking.trackers)

    def status(self, case: str) -> str:
        """Verdict on a case: complete, implausible, failed, retired, or unfinished."""
        row = self.rows[case]
        return (self._status[row] if row < len(self._status) else "") or UNFINISHED

    def reason(self, case: str) -> str:
        """Why a case is not complete; empty if it is, or if no run has said so."""
        row = self.rows[case]
        return self._reason[row] if row < len(self._reason) else ""

    def is_written(self, path: str, case: str, view: str | None = None) -> bool:
        """Whether the job of a case (and view) wrote its part of an array."""
        row = (self.rows[case],) if view is None else (self.rows[case], self.indices[view])
        return self.reader.has(path) and self.reader.is_written(path, *row)

    def config_of(self, case: str) -> Config:
        """Configuration of a case, as far as its probe and its image go."""
        return Beams(self.reader).config(case)

    def labels(self, case: str) -> dict[str, object]:
        """Swept keys and labels of a case, as the table of cases has them."""
        group, row = self.reader.path / "cases", self.rows[case]
        names = sorted(path.parent.name for path in group.glob("*/zarr.json"))
        names = [name for name in names if name not in ("case", "status", "reason")]
        values = {name: self.reader.array(f"cases/{name}") for name in names}
        return {name: np.asarray(array[row]).item() for name, array in values.items() if row < array.shape[0]}

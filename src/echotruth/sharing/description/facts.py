"""What is to be known of a finished repository to describe it, and the table of its clips."""

from dataclasses import dataclass
from datetime import UTC, date, datetime
from functools import cached_property
from importlib.util import find_spec
from typing import Any

import pandas as pd

from echotruth.extras import installation
from echotruth.repository.check import check
from echotruth.repository.checksums import CHECKSUMS
from echotruth.repository.reader import Repository
from echotruth.repository.status import ALWAYS, is_label
from echotruth.sharing.description.attribution import Attribution, Author
from echotruth.sharing.export.clip import ExportedClip

CLIPS = "clips.csv"
COLUMNS = {
    "case": "id of the case, as in cases.csv",
    "view": "name of the view",
    "size_px": "pixels along a side",
    "frames": "number of frames, the first at end-diastole",
    "frame_time_s": "time from one frame to the next, s",
    "pixel_m": "height and width of a pixel, m",
    "array": "path of the array in the store",
}
"""Column of the table of clips -> what it holds."""


class DescriptionError(ValueError):
    """Raised if a repository cannot be described."""


@dataclass(frozen=True)
class Facts:
    """What is to be known of a repository: it, its attribution with an author, and the time of its publication."""

    repository: Repository
    attribution: Attribution
    ended: datetime

    @property
    def name(self) -> str:
        """Name of the repository."""
        return self.repository.config.name

    @property
    def title(self) -> str:
        """Title of the data."""
        return f"{self.name}: synthetic echocardiograms with their true motion"

    @property
    def published(self) -> date:
        """Day of publication."""
        return self.attribution.published or self.ended.date()

    @property
    def packages(self) -> dict[str, str]:
        """Package that made it -> its version."""
        return dict(sorted(self.repository.attributes("")["packages"].items()))

    @property
    def swept(self) -> dict[str, list[Any]]:
        """Keys in which the cases differ -> their distinct values."""
        cases = self.repository.cases
        return {key: cases[key].unique().tolist() for key in cases if key not in ALWAYS and not is_label(key)}

    @cached_property
    def clips_table(self) -> bytes:
        """Table of the clips, a row for everything that has B-mode images."""
        found, sizes = self.repository.finished(None, None, "bmode"), sorted(self.repository.sizes)
        clips = [
            ExportedClip(self.repository, case, view, size) for case, views in found for view in views for size in sizes
        ]
        return pd.DataFrame(map(_row, clips), columns=list(COLUMNS)).to_csv(index=False).encode()


def read_facts(repository: Repository, given: Attribution) -> Facts:
    """Read what is to be known of a repository; DescriptionError if it is not finished, or cannot be described."""
    if find_spec("mlcroissant") is None:
        raise DescriptionError(f"a description needs the package mlcroissant: {installation('description')}")
    folder, report = repository.folder, check(repository.folder, quick=True)
    unpublished = [] if (folder / CHECKSUMS).is_file() else report.notes
    if problems := [*unpublished, *map(str, report.faults)]:
        remedy = f"run its configuration to its end; echotruth check {folder} lists all faults"
        raise DescriptionError(f"{folder}: is not finished, or damaged ({problems[0]}): {remedy}")
    authors = given.authors or (Author(f"The authors of the repository {repository.config.name}"),)
    # Whole seconds, so that file systems that keep no fractions give the same.
    ended = datetime.fromtimestamp(int((folder / CHECKSUMS).stat().st_mtime), UTC)
    return Facts(repository, given._replace(authors=authors), ended)


def _row(clip: ExportedClip) -> tuple[Any, ...]:
    path = clip.repository.path(f"bmode/{clip.size}/image", clip.case.id, clip.view)
    times = len(clip.time), f"{clip.frame_time:.9g}"
    return clip.case.id, clip.view, clip.size, *times, f"{clip.spacing:.9g}", path

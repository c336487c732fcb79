"""What is to be known of a finished repository to release it, and the table of its clips."""

from dataclasses import dataclass
from datetime import UTC, date, datetime
from functools import cached_property
from typing import Any

import pandas as pd

from echotruth.repository.check import check
from echotruth.repository.checksums import CHECKSUMS
from echotruth.repository.reader import Repository
from echotruth.repository.status import ALWAYS, is_label
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.release.attribution import Attribution, Author
from echotruth.units import mm

CLIPS = "clips.csv"
"""Name of the table of clips: case, view, size, frames, time and pixel in SI, and path of the images in the store. A
voxel has three sides: axial, elevation, lateral."""


class ReleaseError(ValueError):
    """Raised if a repository cannot be released; the message says why, and what to do."""


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
        return self.ended.date()

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
        return pd.DataFrame(map(_row, clips)).to_csv(index=False).encode()


def read_facts(repository: Repository, given: Attribution) -> Facts:
    """Read what is to be known of a repository; ReleaseError if it is not finished, or damaged."""
    folder, report = repository.folder, check(repository.folder, quick=True)
    unpublished = [] if (folder / CHECKSUMS).is_file() else report.notes
    if problems := [*unpublished, *map(str, report.faults)]:
        remedy = f"run its configuration to its end; echotruth check {folder} lists all faults"
        raise ReleaseError(f"{folder}: is not finished, or damaged ({problems[0]}): {remedy}")
    authors = given.authors or (Author(f"The authors of the repository {repository.config.name}"),)
    # Whole seconds, so that file systems that keep no fractions give the same.
    ended = datetime.fromtimestamp(int((folder / CHECKSUMS).stat().st_mtime), UTC)
    return Facts(repository, given._replace(authors=authors), ended)


def _row(clip: ExportedClip) -> dict[str, Any]:
    config = clip.case.config
    name = "volume" if config.has_volumes else str(clip.size)
    sides = config.volume.voxel_mm if config.has_volumes else (config.bmode.field_of_view_mm / clip.size,)
    return {
        "case": clip.case.id,
        "view": clip.view,
        "size_px": clip.size,
        "frames": len(clip.time),
        "frame_time_s": f"{clip.frame_time:.9g}",
        "pixel_m": " ".join(f"{side * mm:.9g}" for side in sides),
        "array": clip.repository.path(f"bmode/{name}/image", clip.case.id, clip.view),
    }

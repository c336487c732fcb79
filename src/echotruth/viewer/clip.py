"""One clip of a repository, of which each part is read when it is first shown."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.imaging.labels import LABELS
from echotruth.repository import schema
from echotruth.viewer.catalogue import Catalogue
from echotruth.workflow.job import Job

Floats32 = NDArray[np.float32]
CURVES = "evaluation/true_courses"
"""Array that has the curves of a view; earlier versions had none."""
PARTS = {
    "images": "bmode/{size}/image",
    "truth": "truth/{size}/displacement",
    "tracking": "tracking/displacement",
    "evaluation": "evaluation/true_displacement",
}
"""Part of a clip to the array by which it is known to be written."""
MISSING = {
    "images": "images",
    "truth": "truth at the pixels",
    "tracking": "tracked motion",
    "evaluation": "scores and strain",
}
"""Part of a clip to what is said to be missing without it."""


@dataclass(frozen=True)
class Clip:
    """A view of a case at one image size.

    Attributes
    ----------
    catalogue : Catalogue
    case, view : str
    size : int
        Pixels along a side.
    """

    catalogue: Catalogue
    case: str
    view: str
    size: int

    @cached_property
    def place(self) -> tuple[int, int]:
        """Row of the case, and index of the view."""
        return self.catalogue.rows[self.case], self.catalogue.indices[self.view]

    @cached_property
    def missing(self) -> list[str]:
        """Parts of the clip that no job has written."""
        paths = {part: path.format(size=self.size) for part, path in PARTS.items()}
        return [part for part, path in paths.items() if not self.catalogue.is_written(path, self.case, self.view)]

    @cached_property
    def job(self) -> Job:
        """What reads the arrays of this case and view by their names."""
        return Job(self.catalogue.reader.folder, "tracking", self.case, self.view, code="viewer")

    def has(self, part: str) -> bool:
        """Whether a part of the clip is written."""
        return part not in self.missing

    @property
    def has_curves(self) -> bool:
        """Whether there are curves of strain and rotation."""
        return self.has("evaluation") and self.catalogue.is_written(CURVES, self.case, self.view)

    def read(self, path: str, *index: Any) -> NDArray[Any]:
        """Part of an array of this case and view."""
        return self.catalogue.reader.read(path, *self.place, *index)

    @cached_property
    def side(self) -> float:
        """Length of a side of the image, m."""
        return float(self.catalogue.config_of(self.case).bmode.si().field_of_view)

    @cached_property
    def is_short_axis(self) -> bool:
        """Whether the view is a short axis."""
        return self.catalogue.config.views[self.view].plane == "short_axis"

    @cached_property
    def frames(self) -> int:
        """Number of frames."""
        return self.catalogue.config.loop.frames

    @cached_property
    def time(self) -> Floats:
        """Time since end-diastole, (frame,), s; numbers of frames where the heart has none yet."""
        path, row = f"bmode/{self.size}/time", self.place[0]
        if not self.catalogue.reader.has(path):
            return np.arange(self.frames, dtype=float)
        return np.asarray(self.catalogue.reader.read(path, row), float)

    @cached_property
    def es_frame(self) -> int | None:
        """Frame of end-systole; None for a heart that was not solved."""
        if not self.catalogue.is_written("mechanics/es_frame", self.case):
            return None
        return int(self.catalogue.reader.read("mechanics/es_frame", self.place[0]))

    @cached_property
    def image(self) -> NDArray[np.uint8]:
        """Grey levels, (frame, axial, lateral)."""
        return self.read(f"bmode/{self.size}/image")

    def label(self, name: str) -> NDArray[np.uint8]:
        """Layer, segment or region of disease at every pixel, (frame, axial, lateral); 0 outside the wall."""
        return self.read(f"truth/{self.size}/labels", slice(None), LABELS.index(name))

    def wall_depth(self) -> Floats32:
        """Wall depth at every pixel, (frame, axial, lateral), NaN outside the wall."""
        return self.read(f"truth/{self.size}/wall_depth")

    def strain(self, component: str) -> Floats32:
        """True strain since end-diastole at every pixel, (frame, axial, lateral); component as "CC"."""
        number = schema.LABELS["strain_component"].index(component)
        return self.read(f"truth/{self.size}/strain", ..., number)

    def flow(self, step: int) -> Floats32:
        """Displacement to the next frame at every so manieth pixel, (frame, axial, lateral, 2): lateral, axial, m.

        It is NaN in the last frame and outside the wall.
        """
        first = step // 2
        every = slice(first, None, step)
        following = schema.LABELS["to"].index("next")
        return self.read(f"truth/{self.size}/flow", slice(None), following, every, every, slice(0, 2))

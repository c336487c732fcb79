"""One clip of a repository, of which each part is read when it is first shown."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.imaging.labels import LABELS
from echotruth.repository import estimates, schema
from echotruth.repository.group import NotWritten
from echotruth.repository.reader import Repository
from echotruth.units import mm

Floats32 = NDArray[np.float32]
PARTS = {"bmode": "images", "truth": "truth at the pixels", "tracking": "tracked motion and its scores"}
"""Stage that makes a part of a clip, and what is said to be missing without it."""


@dataclass(frozen=True)
class Clip:
    """A view of a case at one image size.

    Attributes
    ----------
    repository : Repository
    case, view : str
    size : int
        Pixels along a side.
    """

    repository: Repository
    case: str
    view: str
    size: int

    @cached_property
    def parts(self) -> list[str]:
        """Parts of the clip that were made."""
        groups = {part: f"{part}/{self.size}" for part in PARTS} | {"tracking": "points"}
        made = {part: self.repository.attributes(group, self.case, self.view) for part, group in groups.items()}
        return [part for part, found in made.items() if found.get("status") == "complete"]

    def read(self, path: str, *index: Any) -> NDArray[Any]:
        """Part of an array of this case and view."""
        return self.repository.read(path, self.case, self.view, *index)

    def true(self, *names: str) -> dict[str, NDArray[Any]]:
        """What is true at the points of the trackers, by name."""
        return estimates.true(self.repository, self.case, self.view, *names)

    def tracked(self, tracker: str, *names: str) -> dict[str, NDArray[Any]]:
        """What a tracker found, by name; ValueError if it was not run on this clip."""
        return estimates.tracked(self.repository, self.case, self.view, tracker, self.size, *names)

    @cached_property
    def config(self) -> Config:
        """Configuration of the case."""
        return self.repository.case(self.case).config

    @cached_property
    def side(self) -> float:
        """Length of a side of the image, m."""
        return float(self.config.bmode.field_of_view_mm * mm)

    @cached_property
    def is_short_axis(self) -> bool:
        """Whether the view is a short axis."""
        return self.config.views[self.view].plane == "short_axis"

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.config.loop.frames

    @cached_property
    def time(self) -> Floats:
        """Time since end-diastole, (frame,), s; numbers of frames where the heart has none yet."""
        try:
            return self.read(f"bmode/{self.size}/time").astype(float)
        except NotWritten:
            return np.arange(self.frames, dtype=float)

    @cached_property
    def es_frame(self) -> int | None:
        """Frame of end-systole; None for a heart that was not solved."""
        found = self.of_heart("mechanics", "es_frame")
        return int(found["es_frame"]) if found else None

    def of_heart(self, group: str, *names: str) -> dict[str, NDArray[Any]]:
        """Arrays of a group of the heart by name; none of one that was not solved."""
        try:
            return self.repository.arrays(group, self.case, None, *names)
        except NotWritten:
            return {}

    @cached_property
    def image(self) -> NDArray[np.uint8]:
        """Grey levels, (frame, axial, lateral)."""
        return self.read(f"bmode/{self.size}/image")

    def label(self, name: str) -> NDArray[np.uint8]:
        """Layer, segment or region of disease at every pixel, (frame, axial, lateral); 0 outside the wall."""
        return self.read(f"truth/{self.size}/labels", slice(None), LABELS.index(name))

    def tissue(self) -> NDArray[np.uint8]:
        """Tissue at every pixel, (frame, axial, lateral); 0 where it has no name."""
        return self.read(f"truth/{self.size}/tissue")

    def wall_depth(self) -> Floats32:
        """Wall depth at every pixel, (frame, axial, lateral), NaN outside the wall."""
        return self.read(f"truth/{self.size}/wall_depth")

    def strain(self, component: str) -> Floats32:
        """True strain since end-diastole at every pixel, (frame, axial, lateral); component as "CC"."""
        number = schema.LABELS["strain_component"].index(component)
        return self.read(f"truth/{self.size}/strain", ..., number)

    def flow(self) -> Floats32:
        """Displacement to the next frame at every pixel, (frame, axial, lateral, 2): lateral, axial, m.

        It is NaN in the last frame and outside the wall.
        """
        following = schema.LABELS["to"].index("next")
        return self.read(f"truth/{self.size}/flow", slice(None), following, ..., slice(0, 2))

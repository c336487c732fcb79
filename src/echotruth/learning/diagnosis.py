"""Clips with the disease of the heart."""

from pathlib import Path
from typing import Any

import numpy as np

from echotruth.learning.items import Item, Items, Place
from echotruth.learning.measurements import scar_size
from echotruth.repository.choice import Names


class Diagnosis(Items):
    """Whole clips with the disease of the heart.

    An item has `image` (frame, axial, lateral), 0 to 1; `time` (frame; s); `es_frame`, that of end-systole;
    `diagnosis`, text, and `label`, its index in `classes`; and `scar_size`, the fraction of the wall's volume that is
    infarcted.

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.
    classes : iterable of str, optional
        Diagnoses in the order of their labels. Default: all of the repository, healthy first and the others by the
        alphabet; the label of a heart so depends on the repository, not on the part of a split it is in.

    Raises
    ------
    ValueError
        If a heart has a diagnosis that is not one of the classes.

    Examples
    --------
    >>> from echotruth.learning import Diagnosis
    >>> clips = Diagnosis("out/demo", views=["mid"], size=128)
    >>> clips.classes, clips[0]["label"]
    (['healthy'], 0)
    """

    stages = ("bmode",)

    def __init__(
        self,
        repository: str | Path,
        cases: Any = None,
        views: Names = None,
        size: int | None = None,
        classes: Names = None,
    ) -> None:
        super().__init__(repository, cases, views, size)
        known = self.repository.distinctions["diagnosis"]
        found = sorted(set(known) - {""}, key=lambda name: (name != "healthy", name))
        self.classes = found if classes is None else list(classes)
        self._scar_sizes: dict[str, np.float32] = {}
        self._diagnosis = {case: str(known[case]) for case, _ in self.places}
        for case, name in self._diagnosis.items():
            if name not in self.classes:
                raise ValueError(f"classes = {self.classes}: the diagnosis of {case} is {name}: add it, or omit it.")

    def item(self, place: Place, within: int) -> Item:
        case, _ = place
        name = self._diagnosis[case]
        if case not in self._scar_sizes:
            self._scar_sizes[case] = np.float32(scar_size(self.repository, case))
        return {
            "image": self.image(place),
            "time": self.time(place),
            "es_frame": int(self.repository.read("mechanics/es_frame", case)),
            "diagnosis": name,
            "label": self.classes.index(name),
            "scar_size": self._scar_sizes[case],
        }

"""Whole clips, with as much of the truth as is asked for: at every pixel, and of the heart."""

from pathlib import Path
from typing import Any

import numpy as np

from echotruth.learning.items import Item, Items, Place
from echotruth.learning.measurements import PHYSIOLOGY, scar_size
from echotruth.repository.choice import Names, require_known

TRUTH = ("displacement", "strain", "wall_depth", "labels", "tissue", "flow")
"""Arrays of the truth, in the group truth/SIZE of docs/schema.md."""

VECTORS = {"displacement", "strain", "flow"}
"""Those with vectors or components."""

GROUPS = {
    **dict.fromkeys(PHYSIOLOGY, "physiology"),
    **{"strain_mean": "kinematics", "layer_strain": "kinematics", "es_frame": "mechanics"},
}
"""Array of a heart -> its group."""

HEART = ("diagnosis", "scar_size", *GROUPS)
"""What can be asked for of the heart."""


class Clips(Items):
    """Whole clips.

    An item has `image` (frame, axial, lateral; 0 to 1), `time` (frame; s), and of the truth what is asked for, with
    vectors and components before the pixels: displacement (frame, 3, axial, lateral; m) and strain (frame, 6, axial,
    lateral) since end-diastole, wall_depth, labels and tissue (docs/schema.md), flow (frame, 2, 3, axial, lateral; m).
    So it has what is asked for of the heart: `strain_mean` (frame, 6), the wall's mean Green-Lagrange strain since
    end-diastole along RR, CC, LL, RC, RL, CL; `layer_strain` (frame, layer, 6); `es_frame`, the frame of end-systole;
    `diagnosis`, text, with `label`, its index in `classes`; `scar_size`, the fraction of the wall's volume that is
    infarcted; and the measurements of :func:`echotruth.learning.cases`, such as `ejection_fraction`.

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.
    truth : iterable of str
        Any of displacement, strain, wall_depth, labels, tissue, flow.
    heart : iterable of str
        Any of diagnosis, scar_size, strain_mean, layer_strain, es_frame and the measurements.
    classes : iterable of str, optional
        Diagnoses in the order of their labels. Default: all of the repository, healthy first and the others by the
        alphabet; the label of a heart so depends on the repository, not on the part of a split it is in.

    Raises
    ------
    ValueError
        If there is no such truth, or a heart whose diagnosis is asked for has one that is not among the classes.

    Examples
    --------
    >>> from echotruth.learning import Clips
    >>> clip = Clips("out/demo", views=["mid"], size=128, truth=["displacement"], heart=["diagnosis"])[0]
    >>> clip["displacement"].shape[1:], clip["diagnosis"], clip["label"]  # the first of every frame
    ((3, 128, 128), 'healthy', 0)
    """

    def __init__(
        self,
        repository: str | Path,
        cases: Any = None,
        views: Names = None,
        size: int | None = None,
        truth: Names = (),
        heart: Names = (),
        classes: Names = None,
    ) -> None:
        given = (("truth", truth, TRUTH), ("heart", heart, HEART))
        self.names, self.of_heart = (
            [require_known(key, name, known) for name in ([names] if isinstance(names, str) else names or ())]
            for key, names, known in given
        )
        self.stages = ("bmode", "truth") if self.names else ("bmode",)
        super().__init__(repository, cases, views, size)
        self._diagnoses = self.repository.distinctions["diagnosis"]
        found = sorted(set(self._diagnoses) - {""}, key=lambda name: (name != "healthy", name))
        self.classes = found if classes is None else list(classes)
        for case, _ in self.places if "diagnosis" in self.of_heart else ():
            if (name := self._diagnoses[case]) not in self.classes:
                raise ValueError(f"classes = {self.classes}: the diagnosis of {case} is {name}: add it, or omit it.")

    def item(self, place: Place, within: int) -> Item:
        found: Item = {name: self.truth(place, name) for name in self.names}
        for name in VECTORS & set(found):
            found[name] = np.ascontiguousarray(np.moveaxis(found[name], -1, -3))
        found |= {name: self._of_heart(place[0], name) for name in self.of_heart}
        if "diagnosis" in found:
            found["label"] = self.classes.index(found["diagnosis"])
        return {"image": self.image(place), "time": self.time(place)} | found

    def _of_heart(self, case: str, name: str) -> Any:
        if name == "diagnosis":
            return str(self._diagnoses[case])
        if name == "scar_size":
            return np.float32(scar_size(self.repository, case))
        value = self.repository.read(f"{GROUPS[name]}/{name}", case)
        return int(value) if name == "es_frame" else np.float32(value)

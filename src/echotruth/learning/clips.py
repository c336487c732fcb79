"""Whole clips, with as much of the truth as is asked for."""

from pathlib import Path
from typing import Any

import numpy as np

from echotruth.learning.items import Item, Items, Place
from echotruth.repository.choice import Names

TRUTH = ("displacement", "strain", "wall_depth", "labels", "tissue", "flow")
"""Arrays of the truth, in the group truth/SIZE of docs/schema.md."""

VECTORS = {"displacement", "strain", "flow"}
"""Those with vectors or components."""


class Clips(Items):
    """Whole clips.

    An item has `image` (frame, axial, lateral; 0 to 1), `time` (frame; s), and of the truth what is asked for, with
    vectors and components before the pixels: displacement (frame, 3, axial, lateral; m) and strain (frame, 6, axial,
    lateral) since end-diastole, wall_depth, labels and tissue (docs/schema.md), flow (frame, 2, 3, axial, lateral; m).

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.
    truth : iterable of str
        Any of displacement, strain, wall_depth, labels, tissue, flow.

    Examples
    --------
    >>> from echotruth.learning import Clips
    >>> clip = Clips("out/demo", views=["mid"], size=128, truth=["displacement"])[0]
    >>> clip["displacement"].shape[1:]  # of every frame
    (3, 128, 128)
    """

    def __init__(
        self, repository: str | Path, cases: Any = None, views: Names = None, size: int | None = None, truth: Names = ()
    ) -> None:
        self.names = (truth,) if isinstance(truth, str) else tuple(truth or ())
        for name in self.names:
            if name not in TRUTH:
                raise ValueError(f"truth = {name!r}: use any of {', '.join(TRUTH)}.")
        self.stages = ("bmode", "truth") if self.names else ("bmode",)
        super().__init__(repository, cases, views, size)

    def item(self, place: Place, within: int) -> Item:
        found = {name: self.truth(place, name) for name in self.names}
        for name in VECTORS & set(found):
            found[name] = np.ascontiguousarray(np.moveaxis(found[name], -1, -3))
        return {"image": self.image(place), "time": self.time(place)} | found

"""Single frames with the label of every pixel."""

from pathlib import Path
from typing import Any

import numpy as np

from echotruth.imaging.labels import LABELS
from echotruth.learning.items import Item, Items, Place
from echotruth.repository.choice import Names, require_known

TARGETS = ("wall", "layer", "segment", "region")


class Segmentation(Items):
    """Single frames with a label at every pixel.

    An item has `image` (1, axial, lateral), 0 to 1; `label` (axial, lateral), uint8; and `frame`.

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.
    target : {"wall", "layer", "segment", "region"}
        What the label is: wall 1 and the rest 0; transmural layer, 1 at the endocardium, or AHA segment, 0 outside; or
        region of disease, 0 healthy or outside (docs/schema.md).

    Examples
    --------
    >>> from echotruth.learning import Segmentation
    >>> item = Segmentation("out/demo", views=["mid"], size=128, target="wall")[0]
    >>> item["image"].shape, item["label"].shape, sorted(set(item["label"].ravel().tolist()))
    ((1, 128, 128), (128, 128), [0, 1])
    """

    def __init__(
        self,
        repository: str | Path,
        cases: Any = None,
        views: Names = None,
        size: int | None = None,
        target: str = "wall",
    ) -> None:
        self.target = require_known("target", target, TARGETS)
        super().__init__(repository, cases, views, size)

    @property
    def arrays(self) -> tuple[str, ...]:
        return (*super().arrays, f"truth/{self.size}/labels")

    @property
    def per_clip(self) -> int:
        return self.frames

    def item(self, place: Place, within: int) -> Item:
        name = "layer" if self.target == "wall" else self.target
        label = self.truth(place, "labels", within, LABELS.index(name))
        if self.target == "wall":
            label = (label > 0).astype(np.uint8)
        return {"image": self.image(place, within)[None], "label": label, "frame": within}

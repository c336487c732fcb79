"""Single frames with the label of every pixel."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.imaging.labels import LABELS
from echotruth.learning.items import Item, Items, Place
from echotruth.repository.choice import Names, require_known

TARGETS = ("wall", "layer", "segment", "region", "tissue")


class Segmentation(Items):
    """Single frames with a label at every pixel.

    An item has `image` (1, axial, lateral), 0 to 1; `label` (axial, lateral), uint8; and `frame`.

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.
    target : {"wall", "layer", "segment", "region", "tissue"}
        What the label is: wall 1 and the rest 0; transmural layer, 1 at the endocardium, or AHA segment, 0 outside; or
        region of disease, 0 healthy or outside; or the tissue: 1 cavity, 2 wall, 3 left
        atrium, and others (docs/schema.md).

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
    def per_clip(self) -> int:
        return self.frames

    def item(self, place: Place, within: int) -> Item:
        return {"image": self.image(place, within)[None], "label": self._label(place, within), "frame": within}

    def _label(self, place: Place, within: int) -> NDArray[np.uint8]:
        if self.target == "tissue":
            return self.truth(place, "tissue", within)
        label = self.truth(place, "labels", within, LABELS.index("layer" if self.target == "wall" else self.target))
        return (label > 0).astype(np.uint8) if self.target == "wall" else label

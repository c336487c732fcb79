"""Clips with the strain of the heart, as targets of regression."""

import numpy as np

from echotruth.learning.items import Item, Items, Place
from echotruth.learning.measurements import physiology

INDICES = ("ejection_fraction", "gls", "twist_peak")
"""Scalars of the group physiology (docs/schema.md)."""


class Strain(Items):
    """Whole clips with the strain of the heart.

    An item has `image` (frame, axial, lateral), 0 to 1; `time` (frame; s); `strain` (frame, 6), the wall's mean
    Green-Lagrange strain since end-diastole along RR, CC, LL, RC, RL, CL; `layer_strain` (frame, layer, 6); `es_frame`,
    the frame of end-systole; `ejection_fraction`, `gls` and `twist_peak` (rad). The strain at every pixel is
    ``Clips(..., truth=["strain"])``.

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.

    Examples
    --------
    >>> from echotruth.learning import Strain
    >>> item = Strain("out/demo", views=["mid"], size=128)[0]
    >>> len(item["strain"]) == len(item["time"]), item["strain"].shape[1]
    (True, 6)
    """

    stages = ("bmode",)

    def item(self, place: Place, within: int) -> Item:
        case, _ = place
        kinematics = ("strain_mean", "layer_strain")
        mean, layers = (self.repository.read(f"kinematics/{name}", case).astype(np.float32) for name in kinematics)
        return {
            "image": self.image(place),
            "time": self.time(place),
            "strain": mean,
            "layer_strain": layers,
            "es_frame": int(self.repository.read("mechanics/es_frame", case)),
        } | {name: np.float32(value) for name, value in physiology(self.repository, case, INDICES).items()}

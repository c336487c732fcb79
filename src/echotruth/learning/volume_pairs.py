"""Pairs of volumes in succession with the motion between them."""

import numpy as np

from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.flow import STEPS
from echotruth.imaging.truth import PixelTruth
from echotruth.learning.items import Item, Items, Place

NEXT = list(STEPS).index("next")


class VolumePairs(Items):
    """Each volume with the next one, and the motion of the tissue from one to the other.

    An item has

    - `image` (2, axial, elevation, lateral), 0 to 1, `frame`, the index of the first, and `spacing` (3,), m: lateral,
      axial and elevation side of a voxel;
    - `flow` (3, axial, elevation, lateral), voxels: lateral, axial and elevation motion of the tissue at a voxel of the
      first volume to where it is in the second, and `flow_m`, the same in m; 0 outside the wall;
    - `wall` (axial, elevation, lateral), bool: voxels of the first volume that are in the wall, where flow is known.

    Flow is computed from the motion of the heart when an item is asked for, which takes a second of a default volume.

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`; there is one size.

    Examples
    --------
    >>> from echotruth.learning import VolumePairs
    >>> pairs = VolumePairs("out/volumes")  # doctest: +SKIP
    >>> pairs[0]["flow"].shape  # doctest: +SKIP
    (3, 144, 128, 96)
    """

    has_volumes = True

    @property
    def per_clip(self) -> int:
        return self.frames - 1

    def item(self, place: Place, within: int) -> Item:
        config = self.repository.case(place[0]).config
        (axial, elevation, lateral), (heart, plane) = voxel_centres(config), self.before_probe(place)
        truth = PixelTruth(heart, plane, axial, lateral, elevation=elevation, frames=[within])
        forth = np.ascontiguousarray(np.moveaxis(truth["flow"][0, NEXT], -1, 0))
        wall, sides = np.isfinite(forth[0]), self.spacing.astype(np.float32)
        flow = np.where(wall, forth, np.float32(0))
        return {
            "image": self.image(place, slice(within, within + 2)),
            "frame": within,
            "spacing": sides,
            "flow": flow / sides[:, None, None, None],
            "flow_m": flow,
            "wall": wall,
        }

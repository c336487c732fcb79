"""Pairs of frames with the true motion between them."""

from typing import Any

import numpy as np

from echotruth.arrays import Floats
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.flow import STEPS, out_of_slice, slice_thickness
from echotruth.learning.items import Item, Items, Place

NEXT, PREVIOUS = list(STEPS).index("next"), list(STEPS).index("previous")
ELEVATION = 2
"""Index along the dimension `vector`."""


class FlowPairs(Items):
    """Each frame with the next one, and the motion of the tissue from one to the other.

    An item has

    - `image` (2, axial, lateral), 0 to 1, `frame`, the index of the first, and `spacing`, m, of pixel centres;
    - `flow` (2, axial, lateral), px: lateral and axial motion of the tissue at a pixel of the first frame to where it
      is in the second, and `flow_m` (3, axial, lateral), m, with that out of the plane; 0 outside the wall;
    - `wall` (axial, lateral), bool: pixels of the first frame that are in the wall, where flow is known;
    - `leaves`, bool: those of them whose tissue is not in the slice any more in the second frame, and `enters`, bool:
      pixels of the second frame whose tissue was not in the slice in the first. The slice is as thick as the two-way -6
      dB width of the beam (docs/flow.md).

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.

    Examples
    --------
    >>> from echotruth.learning import FlowPairs
    >>> pairs = FlowPairs("out/demo", size=128)
    >>> pairs[0]["image"].shape, pairs[0]["flow"].shape
    ((2, 128, 128), (2, 128, 128))
    """

    _slice: tuple[Any, Floats] = None, np.zeros(0)

    @property
    def per_clip(self) -> int:
        return self.frames - 1

    def item(self, place: Place, within: int) -> Item:
        forth = np.ascontiguousarray(np.moveaxis(self.truth(place, "flow", within, NEXT), -1, 0))
        back = self.truth(place, "flow", within + 1, PREVIOUS, ..., ELEVATION)
        thickness, wall = self._thickness(place), np.isfinite(forth[0])
        flow = np.where(wall, forth, np.float32(0))
        return {
            "image": self.image(place, slice(within, within + 2)),
            "frame": within,
            "spacing": np.float32(self.spacing),
            "flow": flow[:2] / np.float32(self.spacing),
            "flow_m": flow,
            "wall": wall,
            "leaves": out_of_slice(forth[ELEVATION], thickness),
            "enters": out_of_slice(back, thickness),
        }

    def _thickness(self, place: Place) -> Floats:
        """Thickness of the slice at every pixel, (axial, lateral), m; that of the last beam is kept."""
        config = self.repository.case(place[0]).config
        beam = config.probe, config.rf, config.phantom.in_plane_only
        if self._slice[0] != beam:
            axial, lateral = pixel_centres(config.bmode, self.size)
            _, range_ = scan_lines(config.probe, config.rf).to_scan_coordinates(lateral, axial[:, None])
            self._slice = beam, slice_thickness(config, range_)
        return self._slice[1]

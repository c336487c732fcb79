"""Clips with points of the tissue that are followed through all frames."""

from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from echotruth.arrays import Floats
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.labels import LABELS
from echotruth.imaging.tracks import follow, visible
from echotruth.learning.items import Item, Items, Place
from echotruth.repository.choice import Names


class PointTracks(Items):
    """Whole clips, and points of the wall followed through all frames, as their tissue moves.

    An item has `image` (frame, axial, lateral), 0 to 1; `time` (frame; s); `start`, the frame in which the points were
    chosen at random among the pixels of the wall; `position` (frame, point, 2), px: lateral, axial, 0 at the centre of
    the first pixel; `position_m` (frame, point, 3), m: lateral, axial, elevation; and `visible` (frame, point), bool:
    whether the point is within the field of view, the scan and the slice, which is as thick as the two-way -6 dB width
    of the beam (docs/flow.md). Positions are those of the material points, and known where they cannot be seen too.

    Parameters
    ----------
    repository, cases, views, size
        See :class:`Items`.
    points : int
        Number of points; of a wall with fewer pixels some occur twice.
    start : int, optional
        Frame in which they are chosen. Default: at random, another in every clip.
    seed : int
        Of the choice of points and frame, with the case and the view.

    Raises
    ------
    ValueError
        If the number of points or the frame is not possible.

    Examples
    --------
    >>> from echotruth.learning import PointTracks
    >>> item = PointTracks("out/demo", views=["mid"], size=128, points=5)[0]
    >>> item["position"].shape[1:], item["start"]
    ((5, 2), 0)
    """

    def __init__(
        self,
        repository: str | Path,
        cases: Any = None,
        views: Names = None,
        size: int | None = None,
        points: int = 64,
        start: int | None = 0,
        seed: int = 0,
    ) -> None:
        super().__init__(repository, cases, views, size)
        if points < 1:
            raise ValueError(f"points = {points}: give a positive number.")
        if start is not None and not 0 <= start < self.frames:
            raise ValueError(f"start = {start}: give a frame from 0 to {self.frames - 1}.")
        self.points, self.start, self.seed = points, start, seed

    def item(self, place: Place, within: int) -> Item:
        case, view = place
        name = sha256(f"{self.seed} {case} {view}".encode()).digest()
        random = np.random.default_rng(np.frombuffer(name[:16], np.uint32))
        start = int(random.integers(self.frames)) if self.start is None else self.start
        wall = np.argwhere(self.truth(place, "labels", start, LABELS.index("layer")))
        pixels = wall[random.choice(len(wall), self.points, replace=len(wall) < self.points)]
        axial, lateral = pixel_centres(self.repository.config.bmode, self.size)
        followed = self._followed(place, start, np.column_stack([lateral[pixels[:, 1]], axial[pixels[:, 0]]]))
        position = (followed[..., :2] - [lateral[0], axial[0]]) / self.spacing
        return {
            "image": self.image(place),
            "time": self.time(place),
            "start": start,
            "position": position.astype(np.float32),
            "position_m": followed.astype(np.float32),
            "visible": visible(self.repository.case(case).config, followed),
        }

    def _followed(self, place: Place, start: int, points: Floats) -> Floats:
        """Positions of the tissue in all frames, (frame, point, 3), m, that is at points (n, 2) of the image in one."""
        heart, plane = self.before_probe(place)
        return follow(heart.nodes + heart.displacement, heart.cells, plane, points, start)

"""The points that the trackers of a clip followed: where they are, how they move, and which pixels they cover."""

from dataclasses import dataclass
from functools import cached_property
from math import ceil

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from echotruth.arrays import Floats
from echotruth.evaluation.strain import RADIUS, StrainOperator
from echotruth.repository import schema
from echotruth.tracking.point_grid import grid_positions
from echotruth.viewer.clip import Clip

SUBDIVISION = 2.0
"""Parts of a tile per pixel, along a side: a tile may be stretched to twice its length without a gap."""


@dataclass(frozen=True)
class Points:
    """Points of the wall at end-diastole, n of them, on a grid.

    Attributes
    ----------
    clip : Clip
        Of which `tracking` was made.
    """

    clip: Clip

    @cached_property
    def _axes(self) -> Floats:
        """Axes of the wall, (axial, lateral, polar, plane)."""
        return self.clip.true("wall_axes")["wall_axes"].astype(float)

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Points of the grid that are in the wall, (axial, lateral)."""
        return np.asarray(np.isfinite(self._axes).all((-2, -1)))

    @cached_property
    def grid(self) -> Floats:
        """Positions of the grid at end-diastole, (axial, lateral, 2): lateral, axial, m.

        They scale with the field of view, in which cases may differ.
        """
        return grid_positions(self.clip.config)

    @cached_property
    def position(self) -> Floats:
        """Positions at end-diastole, (n, 2): lateral, axial, m."""
        return self.grid[self.inside]

    @cached_property
    def spacing(self) -> float:
        """Distance of neighbours, m."""
        return float(self.grid[0, 1, 0] - self.grid[0, 0, 0])

    @cached_property
    def _true_displacement(self) -> Floats:
        """In the plane, on the grid, (frame, axial, lateral, 2), m."""
        return self.clip.true("true_displacement")["true_displacement"][..., :2].astype(float)

    @cached_property
    def true_displacement(self) -> Floats:
        """True displacement in the plane since end-diastole, (frame, n, 2): lateral, axial, m."""
        return self._true_displacement[:, self.inside]

    def tracked_displacement(self, tracker: str) -> Floats:
        """Tracked displacement since end-diastole, (frame, n, 2): lateral, axial, m; NaN where there is none.

        Raises
        ------
        ValueError
            If a tracker from outside was not evaluated on this clip.
        """
        return self.clip.tracked(tracker, "displacement")["displacement"][:, self.inside].astype(float)

    @cached_property
    def extent(self) -> tuple[float, float, float]:
        """The square about the wall in all frames: its centre (lateral, axial) and half of its side, m."""
        path = self.position + self.true_displacement
        low, high = np.nanmin(path, axis=(0, 1)), np.nanmax(path, axis=(0, 1))
        lateral, axial = (low + high) / 2
        return float(lateral), float(axial), float((high - low).max() / 2)

    def true_strain(self) -> Floats:
        """True strain of the motion in the plane, (frame, n, 3): radial, tangential, shear.

        It is what a tracker could find: motion out of the plane does not count.
        """
        number = schema.LABELS["reference"].index("plane")
        return self.clip.true("true_strain")["true_strain"][number][:, self.inside].astype(float)

    def tracked_strain(self, tracker: str) -> Floats:
        """Strain of the tracked displacement by the operator of the evaluation, (frame, n, 3)."""
        return self._operator.strain(self.tracked_displacement(tracker))

    @cached_property
    def _operator(self) -> StrainOperator:
        return StrainOperator(self.position, self._axes[self.inside], RADIUS * self.clip.side)

    @cached_property
    def coverage(self) -> NDArray[np.int32]:
        """Number of the point at every pixel, from 1, (frame, axial, lateral); 0 where there is none.

        A point covers the tile of the grid around it, which moves and deforms with the true motion.
        """
        parts = ceil(SUBDIVISION * self.spacing / self.clip.side * self.clip.size) + 1
        number = np.zeros(self.inside.shape, np.int32)
        number[self.inside] = np.arange(1, len(self.position) + 1)
        tiles = np.repeat(np.repeat(number, parts, axis=0), parts, axis=1)
        wanted = tiles > 0
        offset = ((np.arange(parts) + 0.5) / parts - 0.5) * self.spacing
        axial, lateral = ((start[:, None] + offset).ravel() for start in (self.grid[:, 0, 1], self.grid[0, :, 0]))
        at_ed = np.stack(np.meshgrid(lateral, axial), axis=-1)[wanted]
        nearest = distance_transform_edt(~self.inside, return_distances=False, return_indices=True)
        found = np.zeros((self.clip.frames, self.clip.size, self.clip.size), np.int32)
        for frame, moved in zip(found, self._true_displacement, strict=True):
            filled = moved[nearest[0], nearest[1]]
            position = at_ed + cv2.resize(filled, wanted.shape[::-1], interpolation=cv2.INTER_LINEAR)[wanted]
            pixel = np.floor(position / self.clip.side * self.clip.size + [self.clip.size / 2, 0]).astype(int)
            shown = ((pixel >= 0) & (pixel < self.clip.size)).all(-1)
            frame[pixel[shown, 1], pixel[shown, 0]] = tiles[wanted][shown]
        return found

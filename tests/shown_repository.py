"""A repository whose images are known at every pixel, and whose wall is a ring that moves by whole pixels."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from known_repository import FRAMES, SETTINGS, SIZES, make

import echotruth as et
from echotruth.tracking.point_grid import grid_positions

SIDE = 12e-3
"""Of the images, m."""
PIXEL = SIDE / SIZES[0]
SHIFT = np.array([3 * PIXEL, -2 * PIXEL, 1e-4])
"""True displacement of the ring in the last frame: lateral, axial, elevation, m; 3 and -2 pixels."""
RADII = 2.5e-3, 5e-3
"""Of the ring about the middle of the image, m."""


@dataclass
class Shown:
    """The repository, and the points of its ring."""

    folder: Path
    position: np.ndarray
    inside: np.ndarray


OF_GRID = SETTINGS | {"tracking": SETTINGS["tracking"] | {"grid": 0.016}}


def shown_at(folder: Path) -> Shown:
    """The repository that is made in a folder."""
    grid = grid_positions(et.configure(OF_GRID))
    radius = np.hypot(grid[..., 0], grid[..., 1] - SIDE / 2)
    inside = (radius > RADII[0]) & (radius < RADII[1])
    return Shown(folder, grid[inside], inside)


def make_shown(folder: Path) -> None:
    """Write the repository, in its folder."""
    inside = shown_at(folder).inside
    share = np.arange(FRAMES)[:, None, None, None] / (FRAMES - 1)
    moved = np.where(inside[..., None], share * SHIFT, np.nan)
    axes = np.where(inside[..., None, None], np.eye(2), np.nan)
    make(folder, OF_GRID, true_displacement=moved, wall_axes=axes)

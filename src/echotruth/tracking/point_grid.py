"""The grid of points that trackers follow, at the same places in the tissue for every image size."""

import numpy as np

from echotruth.config import Config
from echotruth.imaging.bmode import pixel_centres
from echotruth.tracking.windows import grid


def spacing_px(config: Config) -> int:
    """Spacing of the points, px of the largest image."""
    return max(1, round(config.tracking.grid * config.bmode.sizes[0]))


def grid_points(config: Config, size: int) -> np.ndarray:
    """Points of the grid, at the same positions in the tissue for every image size.

    Parameters
    ----------
    config : Config
    size : int
        Image size in whose pixels the positions are given.

    Returns
    -------
    ndarray of shape (grid rows, grid columns, 2)
        Lateral, axial, px; pixel centres of the largest image.
    """
    largest = config.bmode.sizes[0]
    # A pixel of a smaller image is the mean of a block of pixels: x_small + 1/2 = (x_largest + 1/2) size / largest.
    return (grid((largest, largest), spacing_px(config)) + 0.5) * (size / largest) - 0.5


def grid_pixels(config: Config) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the pixels of the largest image that are the points, each (grid rows, grid columns)."""
    lateral, axial = np.moveaxis(grid_points(config, config.bmode.sizes[0]).round().astype(int), -1, 0)
    return axial, lateral


def grid_positions(config: Config) -> np.ndarray:
    """Positions of the grid, (grid rows, grid columns, 2): lateral, axial, m."""
    axial, lateral = pixel_centres(config.bmode, config.bmode.sizes[0])
    rows, columns = grid_pixels(config)
    return np.stack([lateral[columns], axial[rows]], axis=-1)

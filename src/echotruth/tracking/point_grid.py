"""The grid of points that trackers follow, at the same places in the tissue for every image size."""

import numpy as np

from echotruth.config import Config
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.bmode import pixel_centres
from echotruth.tracking.windows import grid
from echotruth.units import mm


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


def grid_voxels(config: Config, spacing: float) -> np.ndarray:
    """Voxels that are points of the grid in volumes.

    Parameters
    ----------
    config : Config
    spacing : float, m
        Distance of the points, as nearly as voxels allow.

    Returns
    -------
    ndarray of shape (point, 3)
        Axial, elevation and lateral index.
    """
    steps = np.maximum(1, np.rint(spacing / (np.array(config.volume.voxel_mm) * mm))).astype(int)
    along = (np.arange(step // 2, count, step) for step, count in zip(steps, config.volume.size, strict=True))
    return np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, 3)


def voxel_positions(config: Config, voxels: np.ndarray) -> np.ndarray:
    """Positions (point, 3), m, of voxels, by indices as of :func:`grid_voxels`: lateral, axial, elevation."""
    axial, elevation, lateral = (each[of] for each, of in zip(voxel_centres(config), voxels.T, strict=True))
    return np.column_stack([lateral, axial, elevation])

"""All views: the plane of each in the heart, and images at end-diastole and end-systole with the border of the wall."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pyvista
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from echotruth.heart import Heart
from echotruth.report import style

SMOOTHED = 1 / 300
"""Standard deviation by which the border is smoothed, which else shows its pixels, over the side of the image."""

ACROSS = {
    "short_axis": np.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]]),
    "long_axis": np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, 1]]),
}
"""Plane of a view -> right, up and normal of the section in which it is a line: the long axis, apex up, and the short
axis, anterior up, the septum on the left in both."""


class Where(NamedTuple):
    """A view in the heart at end-diastole, mm.

    Attributes
    ----------
    wall : ndarray of shape (n, 2, 2)
        Pieces of the borders of a section of the wall: their ends, to the right and up.
    normal : ndarray of shape (2,)
        Of the line of the view in that section.
    point : ndarray of shape (2,)
        Of the line.
    """

    wall: NDArray[np.float64]
    normal: NDArray[np.float64]
    point: NDArray[np.float64]


def where(heart: Heart, plane: str, origin: Sequence[float], normal: Sequence[float]) -> Where:
    """Section of the heart across a view, with its plane given by a point of it, m, and its normal.

    Parameters
    ----------
    heart : Heart
    plane : {"short_axis", "long_axis"}
    origin, normal : sequence of float, (3,)
        In the heart frame, as the attributes of a clip give them.
    """
    nodes, axes = heart.positions(0), ACROSS[plane]
    grid = pyvista.UnstructuredGrid({pyvista.CellType.QUADRATIC_TETRA: heart.cells.astype(np.int64)}, nodes)
    surface = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)
    middle = np.array([0, 0, nodes[:, 2].mean()])
    cut = surface.slice(normal=axes[2], origin=middle)
    ends = np.asarray(cut.points)[cut.lines.reshape(-1, 3)[:, 1:]]
    across = axes[:2] @ np.asarray(normal)
    point = across * ((np.asarray(origin) - middle) @ np.asarray(normal)) / (across @ across)
    return Where(1e3 * (ends - middle) @ axes[:2].T, across, 1e3 * point)


@style.styled
def draw(pictures: Mapping[str, Sequence[xr.Dataset]], places: Mapping[str, Where], field_of_view: float) -> Figure:
    """Draw one column per view: where it is, and end-diastole above end-systole.

    Parameters
    ----------
    pictures : mapping of view to sequence of two Dataset
        Frames at ED and ES, with `image`, grey levels, and `layer`, that at the endocardium 1 and 0 outside the wall.
    places : mapping of view to Where
    field_of_view : float
        Side of the images, m; the array stands in the middle of the upper edge.
    """
    side = 1e3 * field_of_view
    left, right, bottom, top = _shown([picture["layer"].values for pair in pictures.values() for picture in pair], side)
    height = 2.6 * min((bottom - top) / (right - left), 1.6)
    figure = style.figure(2.6 * len(pictures) + 0.5, 2 * height + 2.4)
    grid = figure.add_gridspec(3, len(pictures), height_ratios=[1.5, height, height])
    for column, (view, pair) in enumerate(pictures.items()):
        _place(figure.add_subplot(grid[0, column], title=style.title(view)), places[view])
        for row, (picture, name) in enumerate(zip(pair, ("ED", "ES"), strict=True), 1):
            panel = figure.add_subplot(grid[row, column])
            _image(panel, picture, side)
            panel.set(xlim=(left, right), ylim=(bottom, top))
            panel.tick_params(labelbottom=row == 2, labelleft=column == 0)
            panel.set(xlabel="Lateral (mm)" if row == 2 else "", ylabel="" if column else "Depth (mm)")
            panel.text(0.04, 0.97, name, color=style.ON_IMAGE, va="top", fontweight="bold", transform=panel.transAxes)
    return figure


def _place(axes: Axes, place: Where) -> None:
    """Draw a section of the wall, and the view in it as a line."""
    axes.add_collection(LineCollection(list(place.wall), colors=style.INK, linewidths=1.2))
    (x, y), (right, up) = place.point.tolist(), place.normal.tolist()
    axes.axline((x, y), (x - up, y + right), color=style.BORDER, linewidth=2.4)
    low, high = place.wall.min((0, 1)), place.wall.max((0, 1))
    margin = 0.12 * (high - low).max()
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal")
    axes.axis("off")


def _image(axes: Axes, picture: xr.Dataset, side: float) -> None:
    """Draw grey levels and the borders of the wall; the side is in mm."""
    extent, is_wall = (-side / 2, side / 2, side, 0), picture["layer"].values > 0
    axes.imshow(picture["image"].values, cmap="gray", vmin=0, vmax=255, extent=extent)
    axial, lateral = ((np.arange(n) + 0.5) / n * side for n in is_wall.shape)
    if is_wall.any() and not is_wall.all():
        smooth = gaussian_filter(is_wall.astype(float), SMOOTHED * len(is_wall))
        axes.contour(lateral - side / 2, axial, smooth, levels=[0.5], colors=style.BORDER, linewidths=1.0)
    axes.set_aspect("equal")
    axes.grid(False)


def _shown(layers: Sequence[np.ndarray], side: float) -> tuple[float, float, float, float]:
    """Part of the images that holds the wall in all of them, with a margin: left, right, bottom, top, mm."""
    wall = np.any([layer > 0 for layer in layers], axis=0)
    if not wall.any():
        return -side / 2, side / 2, side, 0.0
    (top, bottom), (left, right) = (_extent(wall.any(axis)) * side for axis in (1, 0))
    half = min(0.58 * max(right - left, 0.5 * (bottom - top)), side / 2)
    middle, margin = (left + right - side) / 2, 0.08 * (bottom - top)
    return middle - half, middle + half, min(bottom + margin, side), max(top - margin, 0.0)


def _extent(is_wall: np.ndarray) -> np.ndarray:
    """Borders of the first and the last pixel that is in the wall, over the side of the image."""
    found = np.flatnonzero(is_wall)
    return np.array([found[0], found[-1] + 1]) / len(is_wall)

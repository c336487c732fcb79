"""All views: the plane of each in the heart, and images at end-diastole and end-systole with the border of the wall."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pyvista
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from echotruth.heart import Heart
from echotruth.report import style

ACROSS = {
    "short_axis": np.array([[-1.0, 0, 0], [0, 0, -1]]),
    "long_axis": np.array([[-1.0, 0, 0], [0, 1, 0]]),
}
"""Plane of a view -> right and up of the section in which it is a line: the long axis, apex up, and the short
axis, anterior up, the septum on the left in both."""


class Picture(NamedTuple):
    """A frame of a view.

    Attributes
    ----------
    image : ndarray of shape (axial, lateral), uint8
        Grey levels.
    border : ndarray of shape (n, 2, 2)
        Pieces of the borders of the wall: their ends, lateral and axial, mm.
    """

    image: NDArray[np.uint8]
    border: NDArray[np.float64]


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


def border(heart: Heart, frame: int, origin: NDArray[np.float64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cut the surface of the wall by a plane.

    Parameters
    ----------
    heart : Heart
    frame : int
    origin : ndarray of shape (3,)
        A point of the plane, m.
    axes : ndarray of shape (2, 3)
        Unit vectors in the plane.

    Returns
    -------
    ndarray of shape (n, 2, 2)
        Pieces of the borders: their ends along the axes from the point, mm.
    """
    cells = {pyvista.CellType.QUADRATIC_TETRA: heart.cells.astype(np.int64)}
    grid = pyvista.UnstructuredGrid(cells, heart.positions(frame))
    surface = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)
    cut = surface.slice(normal=np.cross(*axes), origin=origin)
    return 1e3 * (np.asarray(cut.points)[cut.lines.reshape(-1, 3)[:, 1:]] - origin) @ axes.T


def where(heart: Heart, plane: str, origin: NDArray[np.float64], normal: NDArray[np.float64]) -> Where:
    """Section of the heart across a view, with its plane given by a point of it, m, and its normal.

    Parameters
    ----------
    heart : Heart
    plane : {"short_axis", "long_axis"}
    origin, normal : ndarray of shape (3,)
        In the heart frame.
    """
    axes, middle = ACROSS[plane], np.array([0, 0, heart.positions(0)[:, 2].mean()])
    across = axes @ normal
    point = across * ((origin - middle) @ normal) / (across @ across)
    return Where(border(heart, 0, middle, axes), across, 1e3 * point)


@style.styled
def draw(pictures: Mapping[str, Sequence[Picture]], places: Mapping[str, Where], field_of_view: float) -> Figure:
    """Draw one column per view: where it is, and end-diastole above end-systole.

    Parameters
    ----------
    pictures : mapping of view to sequence of two Picture
        Frames at ED and ES.
    places : mapping of view to Where
    field_of_view : float
        Side of the images, m; the array stands in the middle of the upper edge.
    """
    side = 1e3 * field_of_view
    left, right, bottom, top = _shown([picture.border for pair in pictures.values() for picture in pair], side)
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


def _image(axes: Axes, picture: Picture, side: float) -> None:
    """Draw grey levels and the borders of the wall; the side is in mm."""
    extent = -side / 2, side / 2, side, 0
    axes.imshow(picture.image, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="bilinear")
    axes.add_collection(LineCollection(list(picture.border), colors=style.BORDER, linewidths=1.0))
    axes.set_aspect("equal")
    axes.grid(False)


def _shown(borders: Sequence[NDArray[np.float64]], side: float) -> tuple[float, float, float, float]:
    """Part of the images that holds the wall in all of them, with a margin: left, right, bottom, top, mm."""
    ends = np.concatenate(borders).reshape(-1, 2)
    if not len(ends):
        return -side / 2, side / 2, side, 0.0
    (left, top), (right, bottom) = ends.min(0), ends.max(0)
    half = min(0.64 * max(right - left, 0.5 * (bottom - top)), side / 2)
    middle, margin = (left + right) / 2, 0.08 * (bottom - top)
    return middle - half, middle + half, min(bottom + margin, side), max(top - margin, 0.0)

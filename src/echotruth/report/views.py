"""All views at end-diastole and end-systole, with the borders of the wall and of its layers."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from echotruth.report import style

BORDER = "#ffb000"
"""Colour of the border of the wall."""

CONTOUR_PIXELS = 256
"""Pixels along the side of an image from which contours are drawn."""


@style.styled
def draw(pictures: Mapping[str, Sequence[xr.Dataset]], field_of_view: float) -> Figure:
    """Draw one column per view, end-diastole above end-systole.

    Parameters
    ----------
    pictures : mapping of view to sequence of two Dataset
        Frames at ED and ES, with `image`, grey levels, and `layer`, that at the endocardium 1 and 0 outside the wall.
    field_of_view : float
        Side of the images, m; the array stands in the middle of the upper edge.
    """
    side = 1e3 * field_of_view
    left, right, bottom, top = _shown([picture["layer"].values for pair in pictures.values() for picture in pair], side)
    height = 2.6 * min((bottom - top) / (right - left), 1.6)
    figure = style.figure(2.6 * len(pictures) + 0.5, 2 * height + 0.8)
    panels = figure.subplots(2, len(pictures), sharex=True, sharey=True, squeeze=False)
    for column, (view, pair) in zip(panels.T, pictures.items(), strict=True):
        column[0].set_title(style.title(view))
        column[1].set_xlabel("Lateral (mm)")
        for panel, picture in zip(column, pair, strict=True):
            _image(panel, picture, side)
            panel.set(xlim=(left, right), ylim=(bottom, top))
    for panel, name in zip(panels[:, 0], ("ED", "ES"), strict=True):
        panel.set_ylabel("Axial (mm)")
        panel.text(0.04, 0.96, name, color=style.ON_IMAGE, va="top", fontweight="bold", transform=panel.transAxes)
    return figure


def _image(axes: Axes, picture: xr.Dataset, side: float) -> None:
    """Draw grey levels and the borders of the wall and, in the left half, of its layers; the side is in mm."""
    extent, layer = (-side / 2, side / 2, side, 0), picture["layer"].values
    axes.imshow(picture["image"].values, cmap="gray", vmin=0, vmax=255, extent=extent)
    step = max(1, layer.shape[0] // CONTOUR_PIXELS)
    layer = layer[step // 2 :: step, step // 2 :: step]
    axial, lateral = ((np.arange(n) + 0.5) / n * side for n in layer.shape)
    for mask, width in ((layer > 0, 1.1), *((layer > k, 0.45) for k in range(1, int(layer.max(initial=0))))):
        if mask.any() and not mask.all():
            # Borders of layers lie within the wall; the right half is left to the speckle.
            hidden = (layer == 0) | (lateral > side / 2)
            shown = np.ma.masked_where(hidden, mask) if width < 1 else mask
            axes.contour(lateral - side / 2, axial, shown, levels=[0.5], colors=BORDER, linewidths=width)
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

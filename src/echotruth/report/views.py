"""All views at end-diastole and end-systole, with the border of the wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from echotruth.report import style

BORDER = "#ffb000"
"""Colour of the border of the wall."""


@dataclass(frozen=True)
class Picture:
    """One frame of a view.

    Attributes
    ----------
    image : ndarray of shape (axial, lateral), uint8
        Grey levels.
    mask : ndarray of shape (axial, lateral), bool
        Whether a pixel is in the wall.
    """

    image: np.ndarray
    mask: np.ndarray


@style.styled
def draw(path: str | Path, pictures: Mapping[str, Sequence[Picture]], field_of_view: float) -> Path:
    """Draw one column per view, end-diastole above end-systole.

    Parameters
    ----------
    path : str or Path
        File to write.
    pictures : mapping of view to sequence of two Picture
        At ED and ES.
    field_of_view : float
        Side of the images, m; the array stands in the middle of the upper edge.

    Returns
    -------
    Path
        The file.
    """
    figure = style.figure(2.6 * len(pictures) + 0.5, 5.7)
    panels = figure.subplots(2, len(pictures), sharex=True, sharey=True, squeeze=False)
    for column, (view, pair) in zip(panels.T, pictures.items(), strict=True):
        column[0].set_title(style.title(view))
        column[1].set_xlabel("Lateral (mm)")
        for panel, picture in zip(column, pair, strict=True):
            _image(panel, picture, 1e3 * field_of_view)
    for panel, name in zip(panels[:, 0], ("ED", "ES"), strict=True):
        panel.set_ylabel("Axial (mm)")
        panel.text(0.04, 0.96, name, color="white", va="top", fontweight="bold", transform=panel.transAxes)
    return style.save(figure, path)


def _image(axes: Axes, picture: Picture, side: float) -> None:
    """Draw grey levels and the border of the wall; the side is in mm."""
    extent, mask = (-side / 2, side / 2, side, 0), picture.mask
    axes.imshow(picture.image, cmap="gray", vmin=0, vmax=255, extent=extent)
    if mask.any() and not mask.all():
        axial, lateral = ((np.arange(n) + 0.5) / n * side for n in mask.shape)
        axes.contour(lateral - side / 2, axial, mask, levels=[0.5], colors=BORDER, linewidths=0.9)
    axes.set(xlim=extent[:2], ylim=extent[2:], aspect="equal")
    axes.grid(False)

"""AHA bullseyes of what is true and what was tracked in the segments, and of the difference."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch, Wedge

from echotruth.aha import BULLSEYE
from echotruth.report import style

COLOURMAP = colormaps[style.SIGNED]

UNSEEN: dict[str, Any] = {"facecolor": "none", "edgecolor": style.TARGET, "hatch": "////"}
"""Look of a segment that no view shows, or in which nothing is tracked."""

ON_LIGHT = "#222222"
"""Colour of numbers on light segments."""


@dataclass(frozen=True)
class Segments:
    """One quantity in the segments.

    Attributes
    ----------
    title : str
        As "Circumferential strain, short-axis views".
    true, tracked : ndarray of shape (17,)
        Its values in segments 1..17; NaN where no view shows the segment, or nothing in it is tracked.
    label : str
        What the colour bar says, with the unit.
    difference_label : str
        The same of the difference.
    """

    title: str
    true: np.ndarray
    tracked: np.ndarray
    label: str = "Strain at ES (%)"
    difference_label: str = "Difference (percentage points)"


@style.styled
def draw(quantities: Sequence[Segments], tracker: str) -> Figure:
    """Draw a row of three bullseyes for each quantity: true, tracked by the tracker named, and their difference."""
    figure = style.figure(9.6, 0.35 + 3.45 * len(quantities))
    rows = figure.subfigures(len(quantities) + 1, 1, squeeze=False, height_ratios=[*[3.45] * len(quantities), 0.35])
    for row, segments in zip(rows[:, 0], quantities, strict=False):
        _row(row, segments, tracker)
    reason = "no view of this kind shows the segment, or nothing in it is tracked"
    hatched = Patch(linewidth=0.6, label=reason, **UNSEEN)
    rows[-1, 0].legend(handles=[hatched], loc="center", fontsize=8.5, labelcolor=style.MUTED)
    return figure


def _row(figure: SubFigure, segments: Segments, tracker: str) -> None:
    panels = figure.subplots(1, 3)
    figure.suptitle(segments.title, fontweight="bold", fontsize=10)
    difference = segments.tracked - segments.true
    common, own = _scale(np.concatenate([segments.true, segments.tracked])), _scale(difference)
    shown = (segments.true, "True", common), (segments.tracked, f"Tracked ({tracker})", common)
    for panel, (values, name, scale) in zip(panels, (*shown, (difference, "Tracked minus true", own)), strict=True):
        small = np.abs(difference).max(initial=0, where=np.isfinite(difference)) < 10
        disc(panel, values, scale, decimals=int(scale is own and small))
        panel.set_title(name, fontweight="normal", fontsize=9)
    bar: dict[str, Any] = {"shrink": 0.8, "aspect": 22, "pad": 0.02}
    figure.colorbar(ScalarMappable(common, COLOURMAP), ax=panels[:2], **bar).set_label(segments.label)
    figure.colorbar(ScalarMappable(own, COLOURMAP), ax=panels[2], **bar).set_label(segments.difference_label)


def disc(axes: Axes, values: np.ndarray, scale: TwoSlopeNorm, decimals: int = 0) -> None:
    """Draw one bullseye: the base outermost, anterior at the top and the septum on the left.

    Parameters
    ----------
    axes : Axes
    values : ndarray of shape (17,)
        One number per segment, written into it; segments that are NaN are hatched.
    scale : TwoSlopeNorm
        Normalisation of the colour map.
    decimals : int
        Of the numbers.
    """
    for value, (inner, outer, start, stop) in zip(values, BULLSEYE, strict=True):
        known = bool(np.isfinite(value))
        colour = COLOURMAP(scale(value))
        look = {"facecolor": colour, "edgecolor": style.PAPER} if known else dict(UNSEEN)
        # Unclipped: names of clip paths in an SVG follow from the last bits of the layout.
        look |= {"linewidth": 1.2 if known else 0.6, "clip_on": False}
        axes.add_patch(Wedge((0, 0), outer, np.degrees(start), np.degrees(stop), width=outer - inner, **look))
        if known:
            angle, radius = (start + stop) / 2, (inner + outer) / 2 if inner else 0
            is_dark = np.dot(colour[:3], (0.299, 0.587, 0.114)) < 0.55
            x, y, text = radius * np.cos(angle), radius * np.sin(angle), f"{float(value):z.{decimals}f}"
            colour = style.ON_IMAGE if is_dark else ON_LIGHT
            axes.text(x, y, text.replace("-", "−"), ha="center", va="center", fontsize=7, color=colour)
    names(axes)


def names(axes: Axes) -> None:
    """Write the names of the walls around the disc."""
    for angle, name, rotation in ((90, "anterior", 0), (180, "septal", 90), (270, "inferior", 0), (0, "lateral", 270)):
        x, y = 1.09 * np.cos(np.radians(angle)), 1.09 * np.sin(np.radians(angle))
        axes.text(x, y, name, ha="center", va="center", rotation=rotation, fontsize=7.5, color=style.MUTED)
    axes.set(xlim=(-1.18, 1.18), ylim=(-1.18, 1.18), aspect="equal")
    axes.axis("off")


def _scale(values: np.ndarray) -> TwoSlopeNorm:
    """Scale symmetric about zero: white is zero, the colour shows the sign; the darkest colours are left out."""
    magnitude = np.abs(values[np.isfinite(values)])
    limit = max(1.2 * float(magnitude.max()), 1.0) if magnitude.size else 1.0
    return TwoSlopeNorm(0, -limit, limit)

"""AHA bullseyes of true and tracked displacement (the paper's figure 3)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import TwoSlopeNorm
from matplotlib.patches import Wedge

from echotruth.aha import BULLSEYE
from echotruth.report import style

UM = 1e-6
"""m."""

COLOURMAP = colormaps["RdBu_r"]
"""Blue below zero, red above."""


@style.styled
def draw(path: str | Path, true: np.ndarray, tracked: np.ndarray, tracker: str) -> Path:
    """Draw true and tracked displacement on one scale, and their difference.

    Parameters
    ----------
    path : str or Path
        File to write.
    true, tracked : ndarray of shape (17,)
        Displacement of segments 1..17 from end-diastole to end-systole, m; NaN where unknown.
    tracker : str
        Name of the tracker.

    Returns
    -------
    Path
        The file.
    """
    figure = style.figure(9.0, 3.9)
    panels = figure.subplots(1, 3)
    difference = tracked - true
    common = _scale(np.concatenate([true, tracked]))
    for panel, values, name, scale in zip(
        panels,
        (true, tracked, difference),
        ("Finite elements", f"Tracked: {tracker}", "Tracking minus FE"),
        (common, common, _scale(difference)),
        strict=True,
    ):
        disc(panel, values / UM, scale)
        panel.set_title(name)
    for scale, axes, shrink, aspect, label in (
        (common, panels[:2], 0.7, 50, "Circumferential displacement at ES (µm)"),
        (_scale(difference), panels[2], 0.9, 25, "Difference (µm)"),
    ):
        bar: dict[str, Any] = {"shrink": shrink, "aspect": aspect, "orientation": "horizontal", "pad": 0.06}
        figure.colorbar(ScalarMappable(scale, COLOURMAP), ax=axes, **bar).set_label(label)
    return style.save(figure, path)


def disc(axes: Axes, values: np.ndarray, scale: TwoSlopeNorm) -> None:
    """Draw one bullseye: the base outermost, anterior at the top and the septum on the left.

    Parameters
    ----------
    axes : Axes
    values : ndarray of shape (17,)
        One number per segment, written into it; segments that are NaN are hatched.
    scale : TwoSlopeNorm
        Normalisation of the colour map.
    """
    for number, (value, (inner, outer, start, stop)) in enumerate(zip(values, BULLSEYE, strict=True), 1):
        known = np.isfinite(value)
        colour = COLOURMAP(scale(value)) if known else "#eeeeee"
        axes.add_patch(
            Wedge(
                (0, 0),
                outer,
                np.degrees(start),
                np.degrees(stop),
                width=outer - inner,
                facecolor=colour,
                edgecolor="white" if known else "#bbbbbb",
                linewidth=1.2,
                hatch=None if known else "////",
            )
        )
        angle, radius = (start + stop) / 2, (inner + outer) / 2 if inner else 0
        position = radius * np.cos(angle), radius * np.sin(angle)
        dark = known and np.dot(colour[:3], (0.299, 0.587, 0.114)) < 0.55
        axes.text(
            *position,
            str(round(value)).replace("-", "−") if known else str(number),
            ha="center",
            va="center",
            fontsize=8.5,
            color="white" if dark else "#222222" if known else "#999999",
        )
    _names(axes)


def _names(axes: Axes) -> None:
    """Write the names of the walls around the disc."""
    for angle, name, rotation in ((90, "anterior", 0), (180, "septal", 90), (270, "inferior", 0), (0, "lateral", 270)):
        x, y = 1.09 * np.cos(np.radians(angle)), 1.09 * np.sin(np.radians(angle))
        axes.text(x, y, name, ha="center", va="center", rotation=rotation, fontsize=8, color="#555555")
    axes.set(xlim=(-1.18, 1.18), ylim=(-1.18, 1.18), aspect="equal")
    axes.axis("off")


def _scale(values: np.ndarray) -> TwoSlopeNorm:
    """Scale symmetric about zero: white is no motion, the colour shows the sign."""
    magnitude = np.abs(values[np.isfinite(values)]) / UM
    limit = max(float(magnitude.max()), 1.0) if magnitude.size else 1.0
    return TwoSlopeNorm(0, -limit, limit)

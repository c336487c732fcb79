"""AHA bullseyes of true and tracked displacement (the paper's figure 3)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import TwoSlopeNorm
from matplotlib.patches import Wedge

from echotruth.aha import RINGS
from echotruth.report import style

UM = 1e-6
"""m."""

COLOURS = colormaps["RdBu_r"]
"""Blue below zero, red above."""


@style.styled
def draw(path: str | Path, true: np.ndarray, tracked: np.ndarray, tracker: str) -> Path:
    """Draw truth, estimate and their difference, the first two on one scale.

    Parameters
    ----------
    path : str or Path
        Picture to write.
    true, tracked : ndarray of shape (17,)
        Displacement at end-systole since end-diastole of segments 1..17, m; NaN where there is none.
    tracker : str
        Name of the one that tracked.

    Returns
    -------
    Path
        The picture.
    """
    sheet = style.figure(9.0, 3.9)
    panels = sheet.subplots(1, 3)
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
    sheet.colorbar(_bar(common), ax=panels[:2], shrink=0.7, aspect=50, orientation="horizontal", pad=0.06).set_label(
        "Circumferential displacement at ES (µm)"
    )
    sheet.colorbar(
        _bar(_scale(difference)), ax=panels[2], shrink=0.9, aspect=25, orientation="horizontal", pad=0.06
    ).set_label("Difference (µm)")
    return style.save(sheet, path)


def disc(axes: Axes, values: np.ndarray, scale: TwoSlopeNorm) -> None:
    """Fill one bullseye: the base outermost, anterior at the top and the septum on the left.

    Parameters
    ----------
    axes : Axes
    values : ndarray of shape (17,)
        One number a segment, written into it; segments that are NaN are hatched.
    scale : TwoSlopeNorm
        From value to colour.
    """
    for number, (value, (inner, outer, start, stop)) in enumerate(zip(values, RINGS, strict=True), 1):
        known = np.isfinite(value)
        colour = COLOURS(scale(value)) if known else "#eeeeee"
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
        middle, radius = (start + stop) / 2, (inner + outer) / 2 if inner else 0
        place = radius * np.cos(middle), radius * np.sin(middle)
        dark = known and np.dot(colour[:3], (0.299, 0.587, 0.114)) < 0.55
        axes.text(
            *place,
            str(round(value)).replace("-", "−") if known else str(number),
            ha="center",
            va="center",
            fontsize=8.5,
            color="white" if dark else "#222222" if known else "#999999",
        )
    _names(axes)


def _names(axes: Axes) -> None:
    """Name the walls around the disc."""
    for angle, name, turn in ((90, "anterior", 0), (180, "septal", 90), (270, "inferior", 0), (0, "lateral", 270)):
        x, y = 1.09 * np.cos(np.radians(angle)), 1.09 * np.sin(np.radians(angle))
        axes.text(x, y, name, ha="center", va="center", rotation=turn, fontsize=8, color="#555555")
    axes.set(xlim=(-1.18, 1.18), ylim=(-1.18, 1.18), aspect="equal")
    axes.axis("off")


def _bar(scale: TwoSlopeNorm) -> ScalarMappable:
    return ScalarMappable(scale, COLOURS)


def _scale(values: np.ndarray) -> TwoSlopeNorm:
    """Symmetric about zero, so that white is no motion and the sign is the colour."""
    finite = np.abs(values[np.isfinite(values)]) / UM
    top = max(float(finite.max()), 1.0) if finite.size else 1.0
    return TwoSlopeNorm(0, -top, top)

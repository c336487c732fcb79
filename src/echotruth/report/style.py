"""Style shared by all figures."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

RADIAL, CIRCUMFERENTIAL, LONGITUDINAL = "#b5382a", "#1f5fa8", "#2f8550"
"""Colours of the wall directions."""

TARGET, SOLVED = "#9a9a9a", "#1a1a1a"
"""Colours of prescribed and of solved values."""

MMHG = 133.322387415
"""Pa."""

styled = matplotlib.rc_context(
    {
        "font.family": "DejaVu Sans",
        "font.size": 9,
        "axes.titlesize": 10,
        "axes.titleweight": "bold",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.linewidth": 0.8,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": "#e4e4e4",
        "grid.linewidth": 0.6,
        "legend.frameon": False,
        "lines.linewidth": 1.6,
        "lines.solid_capstyle": "round",
        "hatch.linewidth": 0.6,
        "savefig.facecolor": "white",
    }
)
"""Decorator of functions that draw a figure."""


def figure(width: float, height: float) -> Figure:
    """Empty figure with automatic layout that needs no display.

    Parameters
    ----------
    width, height : float
        inch.

    Returns
    -------
    Figure
    """
    empty = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(empty)
    return empty


def save(figure: Figure, path: str | Path, dpi: int = 160) -> Path:
    """Write a figure to a file, without dates, so that the same figure gives the same bytes.

    Parameters
    ----------
    figure : Figure
    path : str or Path
        The suffix determines the format.
    dpi : int

    Returns
    -------
    Path
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    undated = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    figure.savefig(path, dpi=dpi, metadata=undated.get(path.suffix))
    return path


def layer_colours(layers: int) -> np.ndarray:
    """Colours of the layers from endo- to epicardium.

    Parameters
    ----------
    layers : int

    Returns
    -------
    ndarray of shape (layers, 4)
        RGBA.
    """
    return matplotlib.colormaps["plasma"](np.linspace(0.05, 0.85, layers))


def mark(axes: Axes, position: tuple[float, float], text: str, offset: tuple[float, float]) -> None:
    """Mark a point with a dot and a label beside it.

    Parameters
    ----------
    axes : Axes
    position : tuple of float
        In data units.
    text : str
    offset : tuple of float
        From the dot to the centre of the label, points.
    """
    axes.plot(*position, "o", color=RADIAL, markersize=5, zorder=5)
    axes.annotate(
        text, position, offset, textcoords="offset points", color=RADIAL, fontweight="bold", ha="center", va="center"
    )


def title(view: str) -> str:
    """Title of a view.

    Parameters
    ----------
    view : str
        Its name in the configuration, with underscores.

    Returns
    -------
    str
    """
    return view.replace("_", " ").capitalize()

"""What all pictures share: the colour, sign, unit and name of each quantity, and the style of figures.

Report, viewer, exported clips and the pictures of the docs take them from here. Strain is in percent and shortening,
which is negative, is blue; angles are in degrees. The apex is up in long axes and in space, as in an apical echo, where
the probe is at the top, and in the middle of a bullseye.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from echotruth.report.palette import BORDER, FLOW, MOTION  # noqa: F401
from echotruth.units import mmHg

INK, MUTED, GRID, SHADE, PAPER = "#1b2026", "#5b646e", "#e3e6e9", "#f2efe8", "#ffffff"
"""Colours of text and axes, of remarks, of grid lines, of shaded spans, and of the paper."""

ON_IMAGE = "#fefefe"
"""Colour of what stands on dark images and segments."""

TARGET, SOLVED = "#9a9fa5", INK
"""Colours of prescribed and of solved values."""

TRUTH = INK
"""Colour of what is true."""


class Quantity(NamedTuple):
    """How a quantity is shown everywhere.

    Attributes
    ----------
    words : str
    symbol : str
        As docs/metrics.md and the store write it.
    unit : str
        A key of `FACTORS`.
    colour : str
        Of its curves.
    """

    words: str
    symbol: str
    unit: str
    colour: str

    @property
    def factor(self) -> float:
        """From SI to the unit."""
        return FACTORS[self.unit]

    @property
    def tex(self) -> str:
        """The symbol with what follows its underscore as an index, as Matplotlib draws it."""
        letter, _, index = self.symbol.partition("_")
        return f"${letter}_{{{index}}}$" if index else letter

    @property
    def plain(self) -> str:
        """Name and unit in plain text."""
        return f"{self.words} {self.symbol} ({self.unit})"

    @property
    def label(self) -> str:
        """Name and unit, for an axis or a colour bar of Matplotlib."""
        return f"{self.words} {self.tex} ({self.unit})"


RADIAL, CIRCUMFERENTIAL, LONGITUDINAL = "#b5382a", "#1f5fa8", "#2f8550"
"""Colours of the wall directions."""

QUANTITIES = {
    "RR": Quantity("Radial strain", "E_RR", "%", RADIAL),
    "CC": Quantity("Circumferential strain", "E_CC", "%", CIRCUMFERENTIAL),
    "LL": Quantity("Longitudinal strain", "E_LL", "%", LONGITUDINAL),
    "RC": Quantity("Radial-circumferential shear", "E_RC", "%", "#8a4f9e"),
    "RL": Quantity("Radial-longitudinal shear", "E_RL", "%", "#c98a1b"),
    "CL": Quantity("Circumferential-longitudinal shear", "E_CL", "%", "#6b7a1f"),
    "ff": Quantity("Strain along the fibres", "E_ff", "%", "#7d6a55"),
    "GCS": Quantity("Circumferential strain", "GCS", "%", CIRCUMFERENTIAL),
    "GLS": Quantity("Longitudinal strain", "GLS", "%", LONGITUDINAL),
    "base": Quantity("Rotation", "of the base", "°", "#2f9aa0"),
    "apex": Quantity("Rotation", "of the apex", "°", "#c8641b"),
    "twist": Quantity("Twist,", "apex less base", "°", INK),
    "pressure": Quantity("Pressure", "in the cavity", "mmHg", INK),
}
"""Green-Lagrange strain of the tissue by its components, strain of the mid-wall contour (docs/metrics.md), and
rotation, which is positive counter-clockwise as seen from the apex."""

FACTORS = {"%": 100.0, "°": float(np.degrees(1)), "mmHg": 1 / mmHg, "µL": 1e9, "mL": 1e6}
"""Unit -> factor from SI."""

MAX_VOLUME_IN_UL = 2e-6
"""Largest volume that is shown in µL, m^3; larger ones are in mL."""

ALONG = {"short_axis": "CC", "long_axis": "LL"}
"""Plane of a view -> strain along the wall in it."""

GLOBAL = {"short_axis": "GCS", "long_axis": "GLS"}
"""Plane of a view -> strain of the mid-wall contour in it."""

SIGNED, UNSIGNED = "RdBu_r", "viridis"
"""Colour maps of Matplotlib: of what has a sign, white at zero, blue below, as shortening is, and red above; and of
what has none."""

STRAIN_LIMIT = 30.0
"""Strain at the ends of the scale over images, %."""

OPACITY = 0.4
"""Of the colours of strain over images, through which the speckle is seen."""

SERIES = ("#b04be0", "#d1477e", "#17aede", "#5a9e1e", "#b58900", "#7a4b2a")
"""Colours of trackers, in the order of the configuration, and of states of hearts: none is that of a quantity. They are
seen on white paper and, the first four, beside true paths over images. Further trackers are grey."""

SIZES = (("#173f73", "o"), ("#3f83cc", "s"), ("#8fb7e3", "v"))
"""Colour and marker of the image sizes, the largest first."""


NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}
"""Metadata of an SVG: none, so that nothing but the figure is in it."""

styled = matplotlib.rc_context({"axes.prop_cycle": cycler(color=SERIES)}, Path(__file__).with_name("figure.mplstyle"))
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


@styled
def save(figure: Figure, path: str | Path, dpi: int = 160) -> Path:
    """Write a figure to a file, without dates, so that the same figure gives the same bytes.

    Parameters
    ----------
    figure : Figure
    path : str or Path
        The suffix determines the format. Without one, the figure is written as PNG on white paper, and as SVG without
        paper.
    dpi : int
        Of the PNG, and of pictures within an SVG.

    Returns
    -------
    Path
        The file; without a suffix, the PNG.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.suffix:
        figure.savefig(path.with_suffix(".svg"), dpi=dpi, facecolor="none", edgecolor="none", metadata=NO_METADATA)
        figure.set_layout_engine("none")  # what is laid out stays where it is
        path = path.with_suffix(".png")
    undated = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    figure.savefig(path, dpi=dpi, metadata=undated.get(path.suffix))
    return path


@styled
def sentence(text: str, height: float = 1.2) -> Figure:
    """Sentence in place of a figure that there is not; the height is in inch."""
    empty = figure(8.4, height)
    empty.text(0.5, 0.5, text, ha="center", va="center", color=MUTED)
    return empty


def plain_logarithmic(axes: Axes, which: Literal["x", "y"], values: np.ndarray) -> None:
    """Make an axis logarithmic, with plain numbers and at least a decade long.

    Parameters
    ----------
    axes : Axes
        After all is drawn.
    which : {"x", "y"}
    values : ndarray
        What the axis has to show; what is not a positive number has no place on it. If there is none, it stays linear.
    """
    axis = axes.xaxis if which == "x" else axes.yaxis
    shown = values[np.isfinite(values) & (values > 0)]
    if not shown.size:
        return
    low, high = float(shown.min()), float(shown.max())
    middle = np.sqrt(low * high)
    limits = min(low / 1.3, middle / np.sqrt(10)), max(high * 1.3, middle * np.sqrt(10))
    axes.set(**{f"{which}scale": "log", f"{which}lim": limits})
    axis.set_major_locator(LogLocator(10, (1.0, 2.0, 5.0) if limits[1] / limits[0] < 60 else (1.0, 3.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def legend_below(figure: Figure, handles: Sequence[Artist]) -> Legend:
    """Legend below the panels, in as few rows as the figure is wide enough for, and as even ones as these can be.

    Parameters
    ----------
    figure : Figure
    handles : sequence of Artist
        Artists with labels.
    """
    for rows in range(1, len(handles) + 1):
        columns = -(-len(handles) // rows)
        legend = figure.legend(handles=handles, loc="outside lower center", ncols=columns)
        if columns == 1 or legend.get_window_extent().width <= figure.bbox.width:
            break
        legend.remove()
    return legend


def size_handles(sizes: Iterable[int]) -> list[Line2D]:
    """Handles of a legend for image sizes (px), the largest first."""
    return [
        Line2D([], [], color=colour, marker=marker, ls="none", label=f"{size} × {size} px")
        for (colour, marker), size in zip(SIZES, sizes, strict=False)
    ]


def volume(largest: float) -> Quantity:
    """The volume of the cavity, in µL or mL by the largest one that is shown, m^3."""
    return Quantity("Volume", "of the cavity", "µL" if largest < MAX_VOLUME_IN_UL else "mL", INK)


def series_colour(number: int) -> str:
    """Colour of the tracker with a place in the configuration, counted from 0."""
    return SERIES[number] if number < len(SERIES) else TARGET


def layer_colours(layers: int) -> np.ndarray:
    """Colours of the layers, or of contours, from endo- to epicardium, which are seen on black and on white.

    Parameters
    ----------
    layers : int

    Returns
    -------
    ndarray of shape (layers, 4)
        RGBA.
    """
    return matplotlib.colormaps["plasma"](np.linspace(0.38, 0.84, layers))


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

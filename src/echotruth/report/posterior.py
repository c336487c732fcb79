"""What was learned of the parameters of a heart together: draws of each and of each pair (a corner plot)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from echotruth.report import style
from echotruth.repository.schema import LABELS

Floats = NDArray[np.float64]

NAMES = {
    "mechanics.active.sheet_share": "Tension along the sheet,\nover that of the fibres",
    "mechanics.active.normal_share": "Tension across the sheet,\nover that of the fibres",
    "fibres.endo_deg": "Helix angle,\nendocardium (°)",
    "fibres.epi_deg": "Helix angle,\nepicardium (°)",
    "loop.edp_mmHg": "Pressure at ED\n(mmHg)",
    "loop.esp_mmHg": "Pressure at ES\n(mmHg)",
    "loop.edv_uL": "Volume at ED (uL)",
    "loop.esv_uL": "Volume at ES (uL)",
    "mechanics.material.stiffness_kPa": "Stiffness C (kPa)",
    "active_tension_kPa": "Active tension\nat ES (kPa)",
}
"""Names of what is inferred of the whole wall."""

RINGS = (range(1, 7), range(7, 13), range(13, 17))
"""AHA segments of each level, around the wall."""

OF_WALL = 3
"""Number of parameters of the whole wall that are shown."""

PROBABLE = (0.9, 0.5)
"""Probabilities of the areas that are filled."""

BINS, SMOOTHING = 40, 2.0
"""Of histograms of two parameters, and the standard deviation in bins by which they are smoothed. Those of one
parameter have half as many."""

PRIOR_TAILS, TAILS = (0.02, 0.98), (0.005, 0.995)
"""Quantiles that an axis has to show, of the draws before anything is seen and after."""


def chosen(fit: Mapping[str, NDArray[Any]]) -> list[str]:
    """Parameters that are shown: contractility of the weakest segment and of its neighbours, and what was learned most
    of the whole wall, by the standard deviation over that of the prior.

    Parameters
    ----------
    fit : mapping of str to ndarray
        Group `inference/fit` of a heart.
    """
    names = LABELS["parameter"]
    inferred, mean = np.isfinite(fit["mean"]), dict(zip(names, fit["mean"], strict=True))
    before = np.where(fit["prior_sd"] > 0, fit["prior_sd"], np.inf)
    learned = {name: fit["sd"][at] / before[at] for at, name in enumerate(names) if inferred[at]}
    known = {name for at, name in enumerate(names) if inferred[at] and fit["identifiable"][at] == 1}
    muscle = [name for name in learned if name.startswith("contractility.")]
    weakest = min([name for name in muscle if name in known] or muscle, key=lambda name: mean[name], default="")
    of_wall = sorted((name for name in learned if name in NAMES), key=lambda name: learned[name])
    around = [weakest, *(name for name in _neighbours(weakest) if name in muscle)] if weakest else []
    return [*around, *of_wall[:OF_WALL]]


def _neighbours(name: str) -> list[str]:
    """Contractility of the segments beside one, at its level."""
    number = int(name.rpartition(".")[2])
    ring = next((list(ring) for ring in RINGS if number in ring), [])
    at = ring.index(number) if ring else 0
    return [f"contractility.{ring[(at + step) % len(ring)]}" for step in (-1, 1) if ring]


@style.styled
def draw(names: Sequence[str], posterior: Floats, prior: Floats, true: Floats) -> Figure:
    """Draw histograms of parameters, and below these the density of each pair.

    Parameters
    ----------
    names : sequence of str
    posterior, prior : ndarray of shape (draw, parameter)
    true : ndarray of shape (parameter,)
        NaN where it is not known.
    """
    number = len(names)
    figure = style.figure(9.6, 9.0)
    panels = figure.subplots(number, number, squeeze=False, sharex="col")
    edges = [_edges(*columns) for columns in zip(posterior.T, prior.T, true, strict=True)]
    for row in range(number):
        for column in range(number):
            panel = panels[row, column]
            panel.grid(visible=False)
            if column > row:
                panel.set_axis_off()
            elif column == row:
                _histogram(panel, posterior[:, row], prior[:, row], true[row], edges[row])
            else:
                _density(panel, posterior[:, [column, row]], true[[column, row]], (edges[column], edges[row]))
    _label(panels, names)
    handles = [
        Patch(facecolor=style.SERIES[0], alpha=0.6, label="inferred; of two, the areas of 50 and 90 %"),
        Line2D([], [], color=style.TARGET, label="before anything is seen"),
        Line2D([], [], color=style.SERIES[1], marker="D", markersize=4, label="true"),
    ]
    figure.legend(handles=handles, loc="upper right")
    return figure


def _edges(posterior: Floats, prior: Floats, true: float) -> Floats:
    """Edges of the bins of a parameter, from its draws (draw,) and its true value."""
    shown = np.concatenate([np.quantile(posterior, TAILS), np.quantile(prior, PRIOR_TAILS), [true]])
    low, high = np.nanmin(shown), np.nanmax(shown)
    margin = 0.05 * (high - low) or 0.05 * abs(low) or 1.0
    return np.linspace(low - margin, high + margin, BINS + 1)


def _histogram(axes: Axes, posterior: Floats, prior: Floats, true: float, edges: Floats) -> None:
    look: dict[str, Any] = {"bins": edges[::2], "density": True}
    axes.hist(posterior, histtype="stepfilled", color=style.SERIES[0], alpha=0.6, **look)
    axes.hist(prior, histtype="step", color=style.TARGET, linewidth=1.2, **look)
    if np.isfinite(true):
        axes.axvline(true, color=style.SERIES[1], linewidth=1.2)
    axes.set_xlim(edges[0], edges[-1])
    axes.set_yticks([])


def _density(axes: Axes, draws: Floats, true: Floats, edges: tuple[Floats, Floats]) -> None:
    """Areas in which pairs of parameters are, of draws (draw, 2)."""
    counts = np.histogram2d(draws[:, 0], draws[:, 1], bins=list(edges))[0]
    density = gaussian_filter(counts, SMOOTHING)
    middle = [(edge[1:] + edge[:-1]) / 2 for edge in edges]
    levels = np.unique([*_levels(density), 1.001 * density.max()])
    if len(levels) > 1:
        axes.contourf(*middle, density.T, levels, colors=[style.SERIES[0]] * 2, alpha=0.4)
        axes.contour(*middle, density.T, levels[:-1], colors=style.SERIES[0], linewidths=0.8)
    if np.isfinite(true).all():
        axes.plot(*true, "D", color=style.SERIES[1], markersize=4)
    axes.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])


def _levels(density: Floats) -> list[float]:
    """Densities above which draws are with the probabilities :data:`PROBABLE`."""
    falling = np.sort(density.ravel())[::-1]
    share = np.cumsum(falling) / max(falling.sum(), 1e-300)
    return [float(falling[np.searchsorted(share, probability)]) for probability in PROBABLE]


def _label(panels: NDArray[Any], names: Sequence[str]) -> None:
    """Name the parameters, below and on the left."""
    for at, name in enumerate(names):
        section, _, number = name.rpartition(".")
        text = NAMES.get(name, f"{section.capitalize()}\nof segment {number}")
        panels[-1, at].set_xlabel(text, fontsize=8)
        if at:
            panels[at, 0].set_ylabel(text, fontsize=8)
        for panel in panels[:, at]:
            panel.tick_params(labelsize=7)
        for panel in panels[at, 1:at]:
            panel.set_yticklabels([])

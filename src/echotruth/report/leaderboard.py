"""The order of the trackers: error of displacement and of strain at every image size and view."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from echotruth.config.imaging import ALL
from echotruth.report import style
from echotruth.report.error import SIZES

PANELS = (
    ("nrmse_all_percent", "NRMSE of displacement at ES (%)"),
    ("ecc_rms_points", "RMS error of $E_{CC}$ at ES (points)"),
    ("err_rms_points", "RMS error of $E_{RR}$ at ES (points)"),
)
"""Figures that are drawn, and what they are."""


@style.styled
def draw(path: str | Path, standings: pd.DataFrame, order: list[str]) -> Path:
    """Draw one line a tracker, the best at the top.

    Parameters
    ----------
    path : str or Path
        Picture to write.
    standings : DataFrame
        As of :func:`echotruth.evaluation.leaderboard.standings`.
    order : list of str
        Trackers from the top.

    Returns
    -------
    Path
        The picture.
    """
    # A grid too coarse for strain, or no short-axis view, leaves a figure without numbers.
    shown = [panel for panel in PANELS if standings[panel[0]].notna().any()] or PANELS[:1]
    sheet = style.figure(2 + 2.8 * len(shown), 1.7 + 0.52 * len(order))
    panels = sheet.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    sizes = sorted(standings["size_px"].unique(), reverse=True)[: len(SIZES)]
    for panel, (figure, title) in zip(panels, shown, strict=True):
        for k, size in enumerate(sizes):
            table = standings[standings["size_px"] == size].set_index("tracker")
            rows = pd.Series(np.arange(len(order)) + 0.26 * (k - (len(sizes) - 1) / 2), order)
            _size(panel, table, figure, rows, SIZES[k])
        panel.set(xlabel=title, xlim=(0, None))
        panel.grid(axis="y", visible=False)
    panels[0].set_yticks(range(len(order)), [_name(standings, tracker) for tracker in order])
    panels[0].set_ylim(len(order) - 0.5, -0.5)
    _legend(sheet, standings, columns=2 * len(shown))
    return style.save(sheet, path)


def _size(axes: Axes, table: pd.DataFrame, figure: str, place: pd.Series, look: tuple[str, str]) -> None:
    """One image size: the views as small rings, their mean as a mark with its interval."""
    colour, marker = look
    views, mean = table[table["view"] != ALL], table[table["view"] == ALL]
    axes.plot(views[figure], views.index.map(place), "o", color=colour, markersize=3, fillstyle="none", alpha=0.5)
    axes.plot(mean[figure], mean.index.map(place), marker, color=colour, markersize=6)
    low, high = mean[f"{figure}_low"], mean[f"{figure}_high"]
    axes.hlines(mean.index.map(place)[low.notna()], low.dropna(), high.dropna(), color=colour, linewidth=1.2)


def _name(standings: pd.DataFrame, tracker: str) -> str:
    """A tracker with its rank at the largest size, the interval of the rank, and how often it failed."""
    of_it = standings[standings["tracker"] == tracker]
    first = of_it[(of_it["view"] == ALL) & (of_it["size_px"] == standings["size_px"].max())].iloc[:1]
    rank, low, high = (first[name].max() for name in ("rank", "rank_low", "rank_high"))
    between = f" ({low:.0f}–{high:.0f})" if np.isfinite(low) else ""
    failed = int(of_it.loc[of_it["view"] == ALL, "failures"].sum())
    ranked = f"{tracker}   {rank:.0f}{between}" if np.isfinite(rank) else tracker
    return f"{ranked}\n{failed} clip{'s' * (failed > 1)} failed" if failed else ranked


def _legend(sheet: Figure, standings: pd.DataFrame, columns: int) -> None:
    sizes = sorted(standings["size_px"].unique(), reverse=True)
    marks = [
        Line2D([], [], color=colour, marker=marker, ls="none", label=f"{size} × {size} px")
        for (colour, marker), size in zip(SIZES, sizes, strict=False)
    ]
    ring = Line2D([], [], color="#666666", marker="o", ls="none", markersize=3, fillstyle="none", label="a view")
    hearts = int(np.nanmax(standings["hearts"]))
    many = "one heart: no interval" if hearts < 2 else f"mean of {hearts} hearts and its 95 % interval"
    line = Line2D([], [], color="#444444", ls="none" if hearts < 2 else "-", linewidth=1.2, label=many)
    sheet.legend(handles=[*marks, ring, line], loc="outside lower center", ncols=columns)

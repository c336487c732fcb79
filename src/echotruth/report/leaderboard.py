"""Leaderboard of the trackers: error of displacement and of strain at every image size and view."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from echotruth.config.imaging import ALL_VIEWS
from echotruth.report import style
from echotruth.report.style import SIZES

PANELS = (
    ("nrmse_all_percent", "NRMSE of displacement\nat ES (%)"),
    ("e_cc_rms_pp", "RMS error of circumferential\nstrain at ES (percentage points)"),
    ("e_ll_rms_pp", "RMS error of longitudinal\nstrain at ES (percentage points)"),
    ("e_rr_rms_pp", "RMS error of radial strain\nat ES (percentage points)"),
    ("segment_e_cc_rms_pp", "RMS error of circumferential strain\nof segments at ES (pp)"),
    ("segment_e_ll_rms_pp", "RMS error of longitudinal strain\nof segments at ES (pp)"),
    ("segment_e_rr_rms_pp", "RMS error of radial strain\nof segments at ES (pp)"),
)
"""Metrics that are drawn, and their labels; the last are those of volumes."""


@style.styled
def draw(standings: pd.DataFrame, order: list[str]) -> Figure:
    """Draw one row per tracker, in the order given from top to bottom.

    The standings are what :func:`echotruth.evaluation.leaderboard.standings` returns.
    """
    # With a grid too coarse for strain, or no short-axis view, a metric has no values.
    shown = [panel for panel in PANELS if panel[0] in standings and standings[panel[0]].notna().any()] or PANELS[:1]
    figure = style.figure(1.9 + 2.1 * len(shown), 1.5 + 0.52 * len(order))
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    sizes = sorted(standings["size_px"].unique(), reverse=True)[: len(SIZES)]
    for panel, (metric, title) in zip(panels, shown, strict=True):
        for k, size in enumerate(sizes):
            table = standings[standings["size_px"] == size].set_index("tracker")
            rows = dict(zip(order, np.arange(len(order)) + 0.26 * (k - (len(sizes) - 1) / 2), strict=True))
            _draw_size(panel, table, metric, rows, SIZES[k])
        panel.set_xlabel(title)
        style.plain_logarithmic(panel, "x", standings[metric].to_numpy(float))
        panel.grid(axis="y", visible=False)
        for border in np.arange(len(order) - 1) + 0.5:
            panel.axhline(border, color=style.GRID, linewidth=0.6)
    panels[0].set_yticks(range(len(order)), [_label(standings, tracker) for tracker in order])
    panels[0].set_ylim(len(order) - 0.5, -0.5)
    _legend(figure, standings, columns=max(2, 2 * len(shown) - 2))
    return figure


def _draw_size(
    axes: Axes, table: pd.DataFrame, metric: str, rows: dict[str, float], appearance: tuple[str, str]
) -> None:
    """Draw one image size: the views as small rings, their mean as a marker with its interval."""
    colour, marker = appearance
    views, mean = table[table["view"] != ALL_VIEWS], table[table["view"] == ALL_VIEWS]
    axes.plot(views[metric], views.index.map(rows), "o", color=colour, markersize=3, fillstyle="none", alpha=0.5)
    axes.plot(mean[metric], mean.index.map(rows), marker, color=colour, markersize=6)
    low, high = mean[f"{metric}_low"], mean[f"{metric}_high"]
    axes.hlines(mean.index.map(rows)[low.notna()], low.dropna(), high.dropna(), color=colour, linewidth=1.2)


def _label(standings: pd.DataFrame, tracker: str) -> str:
    """Name of a tracker, its rank at the largest size with the interval, and the number of clips that failed."""
    own = standings[standings["tracker"] == tracker]
    largest = own[(own["view"] == ALL_VIEWS) & (own["size_px"] == standings["size_px"].max())].iloc[:1]
    rank, low, high = (largest[name].max() for name in ("rank", "rank_low", "rank_high"))
    interval = f" ({low:.0f}–{high:.0f})" if np.isfinite(low) else ""
    failed = int(own.loc[own["view"] == ALL_VIEWS, "failures"].sum())
    ranked = f"{tracker}   {rank:.0f}{interval}" if np.isfinite(rank) else tracker
    return f"{ranked}\n{failed} clip{'s' * (failed > 1)} failed" if failed else ranked


def _legend(figure: Figure, standings: pd.DataFrame, columns: int) -> None:
    sizes = sorted(standings["size_px"].unique(), reverse=True)
    marks = style.size_handles(sizes) if len(sizes) > 1 else []
    ring = Line2D([], [], color=style.MUTED, marker="o", ls="none", markersize=3, fillstyle="none", label="one view")
    hearts = int(np.nanmax(standings["hearts"]))
    text = "mean over the views" if hearts < 2 else f"mean of {hearts} hearts and its 95 % interval"
    look = {"ls": "none", "marker": "o"} if hearts < 2 else {"ls": "-", "linewidth": 1.2}
    mean = Line2D([], [], color=style.MUTED, label=text, **look)
    figure.legend(handles=[*marks, ring, mean], loc="outside lower center", ncols=columns)

"""Figures of the page of the benchmark: error by condition, error over the floor, and reliability of the quality."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.resampling import CLIP
from echotruth.report import style
from echotruth.report.style import SIZES

from .standings import main_errors


@style.styled
def draw_conditions(path: Path, standings: pd.DataFrame, floors: pd.DataFrame, order: list[str]) -> Path:
    """Draw the median error of every tracker with its interval, a panel for each main condition.

    Parameters
    ----------
    path : Path
        PNG to write.
    standings : DataFrame
        As `standings.standings` returns it.
    floors : DataFrame
        Columns condition, size_px and floor_percent, the median over the clips.
    order : list of str
        Trackers from top to bottom.

    Returns
    -------
    Path
        The file.
    """
    table = main_errors(standings)
    conditions, sizes = list(dict.fromkeys(table["condition"])), sorted(table["size_px"].unique(), reverse=True)[:3]
    columns = min(len(conditions), 2)
    lines = -(-len(conditions) // columns)
    figure = style.figure(1.7 + 3.0 * columns, 0.8 + lines * (0.6 + 0.36 * len(order)))
    panels = figure.subplots(lines, columns, sharey=True, sharex=True, squeeze=False).ravel()
    for panel in panels[len(conditions) :]:
        panel.set_visible(False)
    for panel, condition in zip(panels, conditions, strict=False):
        for k, (size, (colour, marker)) in enumerate(zip(sizes, SIZES, strict=False)):
            of_size = table[(table["condition"] == condition) & (table["size_px"] == size)].set_index("tracker")
            rows = np.array([order.index(tracker) for tracker in of_size.index]) + 0.24 * (k - (len(sizes) - 1) / 2)
            panel.plot(of_size["value"], rows, marker, color=colour, markersize=5)
            known = of_size["low"].notna().to_numpy()
            panel.hlines(rows[known], of_size["low"][known], of_size["high"][known], color=colour, linewidth=1.2)
            floor = floors[(floors["condition"] == condition) & (floors["size_px"] == size)]["floor_percent"]
            panel.vlines(floor, -0.5, len(order) - 0.5, color=colour, linewidth=1.0, linestyle=":")
        panel.set_title(condition)
        panel.grid(axis="y", visible=False)
    for panel in panels[len(conditions) - columns : len(conditions)]:
        panel.set_xlabel("NRMSE at ES (%)")
        panel.tick_params(labelbottom=True)
    drawn = table[["value", "low", "high"]].to_numpy(float)
    for panel in panels:
        style.plain_logarithmic(panel, "x", np.concatenate([drawn.ravel(), floors["floor_percent"].to_numpy(float)]))
    panels[0].set_yticks(range(len(order)), order)
    panels[0].set_ylim(len(order) - 0.5, -0.5)
    marks = [
        Line2D([], [], color=colour, marker=marker, ls="-", linewidth=1.2, label=f"{size} px")
        for size, (colour, marker) in zip(sizes, SIZES, strict=False)
    ]
    floor = Line2D([], [], color=style.MUTED, ls=":", linewidth=1.0, label="floor")
    style.legend_below(figure, [*marks, floor])
    return style.save(figure, path, dpi=120)


@style.styled
def draw_floors(path: Path, clips: pd.DataFrame, difficulty: pd.DataFrame, order: list[str]) -> Path:
    """Draw the error of trackers in every clip over the floor of the clip, a panel for each image size.

    Parameters
    ----------
    path : Path
        PNG to write.
    clips : DataFrame
        As `records.Records` holds them.
    difficulty : DataFrame
        Its table of that name.
    order : list of str
        Trackers that are drawn, the first on top.

    Returns
    -------
    Path
        The file.
    """
    both = clips.merge(difficulty[[*CLIP, "floor_percent"]], on=list(CLIP))
    figure, panels = _panels(both)
    for size, panel in panels.items():
        for k, tracker in reversed(list(enumerate(order))):
            of = both[(both["size_px"] == size) & (both["tracker"] == tracker)]
            panel.plot(of["floor_percent"], of[RANKED_BY], "o", color=style.series_colour(k), markersize=3.5, alpha=0.8)
        panel.set_xlabel("floor of the clip (%)")
    first = next(iter(panels.values()))
    first.set_ylabel("NRMSE at ES (%)")
    style.plain_logarithmic(first, "x", both["floor_percent"].to_numpy(float))
    style.plain_logarithmic(first, "y", both[both["tracker"].isin(order)][RANKED_BY].to_numpy(float))
    for panel in panels.values():
        (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
        ends = np.array([min(left, low), max(right, high)])
        panel.plot(ends, ends, color=style.MUTED, linewidth=0.9, linestyle="--")
        panel.set(xlim=(left, right), ylim=(low, high))
    marks = [
        Line2D([], [], color=style.series_colour(k), marker="o", ls="none", markersize=4, label=tracker)
        for k, tracker in enumerate(order)
    ]
    line = Line2D([], [], color=style.MUTED, ls="--", linewidth=0.9, label="error = floor")
    figure.legend(handles=[*marks, line], loc="outside lower center", ncols=2 * len(panels))
    return style.save(figure, path, dpi=120)


@style.styled
def draw_reliability(path: Path, curves: pd.DataFrame, order: list[str]) -> Path:
    """Draw how many points are where a tracker says, over its quality, a panel for each image size.

    Parameters
    ----------
    path : Path
        PNG to write.
    curves : DataFrame
        As :func:`.reliability.curve` returns it.
    order : list of str
        Trackers that are drawn, the first on top.

    Returns
    -------
    Path
        The file.
    """
    figure, panels = _panels(curves)
    for size, panel in panels.items():
        panel.plot([0, 100], [0, 100], color=style.MUTED, linewidth=0.9, linestyle="--")
        for k, tracker in reversed(list(enumerate(order))):
            of = curves[(curves["size_px"] == size) & (curves["tracker"] == tracker) & (curves["count"] > 0)]
            _curve(panel, of, style.series_colour(k))
        panel.set_xlabel("stated quality (%)")
        panel.set(xlim=(0, 100), ylim=(0, 100))
    next(iter(panels.values())).set_ylabel("points within 1/256 of the image (%)")
    marks = [
        Line2D([], [], color=style.series_colour(k), marker="o", markersize=3, linewidth=1.2, label=tracker)
        for k, tracker in enumerate(order)
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=2 * len(panels))
    return style.save(figure, path, dpi=120)


def _panels(table: pd.DataFrame) -> tuple[Figure, dict[int, Axes]]:
    """Figure with a panel for each image size of a table, three at most, the largest first."""
    sizes = sorted(table["size_px"].unique(), reverse=True)[:3]
    figure = style.figure(0.9 + 2.5 * len(sizes), 3.4)
    panels = figure.subplots(1, len(sizes), sharex=True, sharey=True, squeeze=False)[0]
    for panel, size in zip(panels, sizes, strict=True):
        panel.set_title(f"{size} px")
    return figure, dict(zip(sizes, panels, strict=True))


def _curve(axes: Axes, of: pd.DataFrame, colour: str) -> None:
    """A curve, of which steps that hold few points are fainter."""
    axes.plot(of["stated_percent"], of["observed_percent"], color=colour, linewidth=1.2)
    fractions = (of["count"] / of["count"].sum()).to_numpy(float)
    axes.scatter(of["stated_percent"], of["observed_percent"], s=4 + 60 * fractions, color=colour, linewidths=0)

"""Figures of the page of the suite: ratios of errors, power, and reliability of the quality."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from echotruth.report import style

from .power import FOUND, Power

DRAWN = len(style.SERIES)
"""Largest number of trackers in a figure whose colours can be distinguished."""


@style.styled
def draw_ratios(path: Path, boards: dict[int, pd.DataFrame]) -> Path:
    """Draw the ratio of the error of every tracker to that of the first with its interval, a panel for each size.

    Parameters
    ----------
    path : Path
        PNG to write.
    boards : dict
        Image size (px) to what :func:`.comparison.ranking` returns.

    Returns
    -------
    Path
        The file.
    """
    order = list(next(iter(boards.values())).index)
    figure, panels = _panels(list(boards), 1.0 + 0.3 * len(order))
    ends = pd.concat(boards.values())[["low", "ratio", "high"]].to_numpy(float)
    shown = np.append(ends[np.isfinite(ends)], 1.0)
    for (size, board), panel in zip(boards.items(), panels, strict=True):
        known = board[board["ratio"].notna()]
        rows = np.array([order.index(name) for name in known.index])
        colour, marker = style.SIZES[0]
        bounded = np.isfinite(known["high"]).to_numpy()
        panel.axvline(1, color=style.MUTED, linewidth=0.9, linestyle="--")
        panel.hlines(rows[bounded], known["low"][bounded], known["high"][bounded], color=colour, linewidth=1.4)
        panel.plot(known["ratio"], rows, marker, color=colour, markersize=5)
        panel.set_title(f"{size} px")
        panel.set_xlabel("error over that of the first")
        panel.grid(axis="y", visible=False)
        style.plain_logarithmic(panel, "x", shown)
    panels[0].set_yticks(range(len(order)), order)
    panels[0].set_ylim(len(order) - 0.5, -0.5)
    return style.save(figure, path, dpi=120)


@style.styled
def draw_power(path: Path, found: dict[str, Power]) -> Path:
    """Draw the probability that a tracker is distinguished from another one over the difference of their errors.

    Parameters
    ----------
    path : Path
        PNG to write.
    found : dict
        Who is compared to the simulated boards.

    Returns
    -------
    Path
        The file.
    """
    figure = style.figure(5.2, 3.2)
    axes = figure.subplots()
    effects = np.linspace(0, 0.5, 101)
    axes.axhline(100 * FOUND, color=style.MUTED, linewidth=0.9, linestyle="--")
    for k, (words, of) in enumerate(found.items()):
        shares = [100 * of.of(effect) for effect in effects]
        axes.plot(100 * effects, shares, color=style.series_colour(k), label=words)
    axes.set(xlabel="error smaller by (%)", ylabel="told apart (%)", xlim=(0, 50), ylim=(0, 101))
    style.legend_below(figure, axes.get_legend_handles_labels()[0])
    return style.save(figure, path, dpi=120)


@style.styled
def draw_reliability(path: Path, curves: pd.DataFrame, order: list[str]) -> Path:
    """Draw how many points are where a tracker says, over its quality, a panel for each image size.

    Parameters
    ----------
    path : Path
        PNG to write.
    curves : DataFrame
        As :func:`.quality.curve` returns it.
    order : list of str
        Trackers, the best first, of which as many are drawn as there are colours.

    Returns
    -------
    Path
        The file.
    """
    sizes = sorted(map(int, curves["size_px"].unique()), reverse=True)
    figure, panels = _panels(sizes, 3.6)
    for size, panel in zip(sizes, panels, strict=True):
        panel.plot([0, 100], [0, 100], color=style.MUTED, linewidth=0.9, linestyle="--")
        for k, tracker in reversed(list(enumerate(order[:DRAWN]))):
            of = curves[(curves["size_px"] == size) & (curves["tracker"] == tracker) & (curves["count"] > 0)]
            _curve(panel, of, style.series_colour(k))
        panel.set(title=f"{size} px", xlabel="stated quality (%)", xlim=(0, 100), ylim=(0, 100), aspect="equal")
    panels[0].set_ylabel("points within 1/256 of the image (%)")
    marks = [
        Line2D([], [], color=style.series_colour(k), marker="o", markersize=3, linewidth=1.2, label=tracker)
        for k, tracker in enumerate(order[:DRAWN])
    ]
    style.legend_below(figure, marks)
    return style.save(figure, path, dpi=120)


def _panels(sizes: list[int], height: float) -> tuple[Figure, list[Axes]]:
    """Figure with a panel for each image size."""
    figure = style.figure(1.4 + 2.7 * len(sizes), height)
    return figure, list(figure.subplots(1, len(sizes), sharex=True, sharey=True, squeeze=False)[0])


def _curve(axes: Axes, of: pd.DataFrame, colour: str) -> None:
    """A curve, on which steps that hold few points have small dots."""
    axes.plot(of["stated_percent"], of["observed_percent"], color=colour, linewidth=1.2)
    fractions = (of["count"] / of["count"].sum()).to_numpy(float)
    axes.scatter(of["stated_percent"], of["observed_percent"], s=4 + 60 * fractions, color=colour, linewidths=0)

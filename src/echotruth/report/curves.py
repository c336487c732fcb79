"""Tracked against true curves over the cycle: strain of the wall and rotation of every view, and strain of segments."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from echotruth.report import style

ROOM = 0.6
"""Range of an axis beyond that of the truth and of the best tracker, to either side, over it; the curves of other
trackers may leave it."""

NO_VALUES = "no tracked values:\nis the grid too coarse?"
"""Words in a panel without curves of trackers: strain needs several points through the wall (`tracking.grid`)."""


@dataclass(frozen=True)
class Panel:
    """Curves of one quantity in one view.

    Attributes
    ----------
    time, end_systole : ndarray of shape (frame,), and float
        Since end-diastole, ms.
    true : ndarray of shape (frame,)
    tracked : dict of ndarray of shape (frame,)
        Tracker -> its curve, the best tracker first; NaN where it has none.
    """

    title: str
    unit: str
    time: np.ndarray
    end_systole: float
    true: np.ndarray
    tracked: Mapping[str, np.ndarray]


@style.styled
def draw(rows: Sequence[Sequence[Panel | None]], trackers: Sequence[str]) -> Figure:
    """Draw panels in rows, all of one length; None leaves a place empty.

    Parameters
    ----------
    rows : sequence of sequences of Panel
    trackers : sequence of str
        In the order of their colours.
    """
    columns = max(map(len, rows))
    colours = {name: style.series_colour(number) for number, name in enumerate(trackers)}
    figure = style.figure(max(2.45 * columns + 0.3, 5.2), 2.15 * len(rows) + 0.5)
    grid = figure.subplots(len(rows), columns, squeeze=False, sharex=False)
    for axes, panel in zip(grid.flat, (panel for row in rows for panel in row), strict=True):
        if panel is None:
            axes.axis("off")
        else:
            _panel(axes, panel, colours)
    for axes in grid[-1]:
        axes.set_xlabel("Time since ED (ms)")
    tracked = dict.fromkeys(name for row in rows for panel in row if panel for name in panel.tracked)
    _legend(figure, {name: colours[name] for name in tracked})
    return figure


def _panel(axes: Axes, panel: Panel, colours: Mapping[str, str]) -> None:
    axes.axhline(0, color=style.MUTED, linewidth=0.6)
    axes.axvline(panel.end_systole, color=style.MUTED, linewidth=0.9, linestyle=":")
    axes.plot(panel.time, panel.true, color=style.TRUTH, linewidth=2.6, zorder=2)
    for name, values in reversed(list(panel.tracked.items())):
        axes.plot(panel.time, values, color=colours[name], linewidth=1.3, zorder=3)
    if panel.tracked and not np.isfinite(list(panel.tracked.values())).any():
        text = axes.text(0.5, 0.4, NO_VALUES, transform=axes.transAxes, color=style.MUTED, fontsize=7, zorder=4)
        text.set(ha="center", va="center", bbox={"facecolor": style.PAPER, "edgecolor": "none", "pad": 2})
    axes.set_ylim(*_limits(panel))
    axes.margins(x=0.01)
    axes.set_title(f"{panel.title} ({panel.unit})", fontsize=8, loc="left")
    axes.tick_params(labelsize=8)


def _limits(panel: Panel) -> tuple[float, float]:
    """Limits that show the truth and the best tracker in full, and of the others what lies near."""
    first = [values for values in panel.tracked.values() if np.isfinite(values).any()][:1]
    core = np.concatenate([panel.true, *first, [0.0]])
    core = core[np.isfinite(core)]
    low, high = float(core.min()), float(core.max())
    room = ROOM * max(high - low, 1e-3)
    every = np.concatenate([core, *panel.tracked.values()])
    every = every[np.isfinite(every)]
    low, high = max(float(every.min()), low - room), min(float(every.max()), high + room)
    margin = 0.06 * max(high - low, 1.0)
    return low - margin, high + margin


def _legend(figure: Figure, colours: Mapping[str, str]) -> None:
    lines = [Line2D([], [], color=style.TRUTH, linewidth=2.6, label="true")]
    lines += [Line2D([], [], color=colour, linewidth=1.3, label=name) for name, colour in colours.items()]
    lines += [Line2D([], [], color=style.MUTED, linewidth=0.9, linestyle=":", label="ES")]
    style.legend_below(figure, lines)

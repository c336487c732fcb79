"""Error of tracked circumferential displacement through the wall (the paper's figure 4)."""

from collections.abc import Collection, Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from echotruth.report import style

TRACKERS: tuple[tuple[str, Literal["none", "full"]], ...] = (("--", "none"), ("-", "full"))
"""Line style and marker fill of the trackers, in their order."""

Errors = Mapping[str, Mapping[str, Mapping[int, np.ndarray]]]


@style.styled
def draw(errors: Errors, longitudinal: Collection[str] = ()) -> Figure:
    """Draw the error by layer, one panel per view, on a logarithmic axis, which shows good and bad trackers.

    Parameters
    ----------
    errors : mapping of view to mapping of tracker to mapping of image size to ndarray of shape (layer,)
        RMS error of circumferential (long axis: longitudinal) displacement at end-systole of one or two trackers, m,
        the endocardium first; NaN where unknown.
    longitudinal : collection of str
        Long-axis views, for which the component is longitudinal.
    """
    figure = style.figure(2.5 * len(errors) + 0.9, 3.9)
    panels = figure.subplots(1, len(errors), sharey=True, squeeze=False)[0]
    for panel, (view, trackers) in zip(panels, errors.items(), strict=True):
        for (line, fill), sizes in zip(TRACKERS, trackers.values(), strict=False):
            for (colour, marker), values in zip(style.SIZES, sizes.values(), strict=False):
                _curve(panel, np.asarray(values), {"color": colour, "marker": marker, "ls": line, "fillstyle": fill})
        component = "longitudinal" if view in longitudinal else "circumferential"
        panel.set_title(style.title(view), pad=16)
        panel.text(0.5, 1.02, component, ha="center", color=style.MUTED, transform=panel.transAxes)
        panel.set(xlabel="Layer, endo → epi")
    panels[0].set_ylabel("RMS error of displacement at ES (µm)")
    drawn = [np.asarray(values) for trackers in errors.values() for of in trackers.values() for values in of.values()]
    style.plain_logarithmic(panels[0], "y", 1e6 * np.concatenate(drawn))
    _legend(figure, next(iter(errors.values())))
    return figure


def _curve(axes: Axes, values: np.ndarray, appearance: dict[str, Any]) -> None:
    layer = np.arange(1, len(values) + 1)
    axes.plot(layer, values * 1e6, markersize=6, linewidth=1.2, **appearance)
    axes.set_xticks(layer)
    axes.set_xlim(0.6, len(values) + 0.4)


def _legend(figure: Figure, trackers: Mapping[str, Mapping[int, np.ndarray]]) -> None:
    lines = [
        Line2D([], [], color=style.MUTED, ls=line, marker="D", markersize=5, fillstyle=fill, linewidth=1.2, label=name)
        for (line, fill), name in zip(TRACKERS, trackers, strict=False)
    ]
    style.legend_below(figure, [*style.size_handles(next(iter(trackers.values()))), *lines])

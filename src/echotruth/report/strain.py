"""Strain of the wall over the cycle: mean and standard deviation, and circumferential strain of the layers."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from echotruth.report import style

DIRECTIONS = ("RR", "CC", "LL")
"""Normal strains in the order of the arrays."""

MIN_AXIS_LIMIT = 0.1
"""Smallest limit of the strain axis to either side, %."""


@style.styled
def draw(time: np.ndarray, es: int, mean: np.ndarray, sd: np.ndarray, layers: np.ndarray) -> Figure:
    """Draw strain since end-diastole.

    Parameters
    ----------
    time : ndarray of shape (frame,)
        Since end-diastole, s.
    es : int
        Frame of end-systole.
    mean, sd : ndarray of shape (frame, strain component)
        Mean and standard deviation over the wall, components RR, CC, LL first.
    layers : ndarray of shape (frame, layer, strain component)
        Mean over every layer, the endocardium first.
    """
    figure = style.figure(8.6, 4.2)
    left, right = figure.subplots(1, 2)
    for k, strain in enumerate(style.QUANTITIES[name] for name in DIRECTIONS):
        average, deviation, colour = 100 * mean[:, k], 100 * sd[:, k], strain.colour
        label = f"{strain.tex} {average[es]:+.1f} ± {deviation[es]:.1f}".replace("-", "−")
        left.fill_between(time * 1e3, average - deviation, average + deviation, color=colour, alpha=0.18, linewidth=0)
        left.plot(time * 1e3, average, color=colour, label=label)
    left.set(title="Wall mean ± standard deviation", ylabel="Strain since end-diastole (%)")
    count = layers.shape[1]
    for k, colour in enumerate(style.layer_colours(count)):
        border = {0: " endo", count - 1: " epi"}.get(k, "")
        right.plot(time * 1e3, 100 * layers[:, k, 1], color=colour, label=f"{k + 1}{border}")
    right.set(title="By layer since end-diastole", ylabel=style.QUANTITIES["CC"].label)
    for panel, columns, name in ((left, 3, "at ES (%)"), (right, min(count, 6), "layer")):
        place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": columns}
        panel.legend(title=name, columnspacing=1, handlelength=1.2, **place)
    for panel in (left, right):
        panel.axvline(time[es] * 1e3, color=style.MUTED, linewidth=0.9, linestyle=":")
        panel.axhline(0, color=style.MUTED, linewidth=0.6)
        panel.text(time[es] * 1e3, 0.99, " ES", color=style.MUTED, va="top", transform=panel.get_xaxis_transform())
        panel.set_xlabel("Time since end-diastole (ms)")
        panel.margins(x=0.01)
        low, high = panel.get_ylim()  # without strain the axis would show rounding errors
        panel.set_ylim(min(low, -MIN_AXIS_LIMIT), max(high, MIN_AXIS_LIMIT))
    return figure

"""Measures of all hearts by their findings."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from echotruth.report import style

MAX_DOTS = 400
"""Hearts of a finding beyond which every k-th is drawn; the bar is that of all."""

SPREAD = 0.28
"""Half the width over which the dots of a finding are spread."""


@style.styled
def draw(measures: Mapping[str, np.ndarray], diagnoses: np.ndarray) -> Figure:
    """Draw a panel for each measure: a dot for every heart, and median and quartiles of each finding.

    A measure that is known of no heart has no panel.

    Parameters
    ----------
    measures : mapping of str to ndarray of shape (heart,)
        Label with the unit -> values; NaN where a heart has none.
    diagnoses : ndarray of shape (heart,), str
        Findings joined by +; a heart is a dot of each of its own.
    """
    known = {label: values for label, values in measures.items() if np.isfinite(values).any()}
    if not known:
        return style.sentence("No measure of these hearts is known.")
    found = [str(words).split("+") for words in diagnoses]
    names = sorted({name for each in found for name in each}, key=lambda name: (name != "healthy", name))
    has = {name: np.array([name in each for each in found]) for name in names}
    figure = style.figure(9.6, 1.3 + 0.42 * len(names))
    panels = figure.subplots(1, len(known), sharey=True, squeeze=False)[0]
    for panel, (label, values) in zip(panels, known.items(), strict=True):
        for place, name in enumerate(names):
            _finding(panel, values[has[name] & np.isfinite(values)], place)
        panel.set_xlabel(label)
        panel.locator_params(axis="x", nbins=4)
        panel.grid(axis="y", visible=False)
        panel.margins(x=0.08)
    labels = [f"{name.replace('_', ' ')} ({np.count_nonzero(has[name])})" for name in names]
    panels[0].set_yticks(range(len(names)), labels)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    return figure


def _finding(axes: Axes, values: np.ndarray, place: int) -> None:
    if not len(values):
        return
    dots = values[:: -(-len(values) // MAX_DOTS)]
    # Fractions of the golden ratio spread dots evenly in any number of them, without chance.
    height = place + SPREAD * (2 * (np.arange(len(dots)) * 0.6180339887 % 1) - 1) * (len(dots) > 1)
    axes.plot(dots, height, "o", color=style.SERIES[0], markersize=3.2, alpha=0.55, markeredgewidth=0)
    if len(values) > 3:
        low, middle, high = np.quantile(values, (0.25, 0.5, 0.75))
        axes.plot([low, high], [place, place], color=style.INK, linewidth=1.6)
        axes.plot(middle, place, "|", color=style.INK, markersize=11, markeredgewidth=2)

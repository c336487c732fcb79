"""Target and solved pressure-volume loop of the heart, with the active tension that drives it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from echotruth.report import style


@style.styled
def draw(time: np.ndarray, es: int, tension: np.ndarray, solved: np.ndarray, target: np.ndarray) -> Figure:
    """Draw the loop and its time courses, or a sentence if the heart has none.

    Parameters
    ----------
    time : ndarray of shape (frame,)
        Since end-diastole, s.
    es : int
        Frame of end-systole.
    tension : ndarray of shape (frame,)
        Active tension T_Ca, Pa.
    solved, target : ndarray of shape (2, frame)
        Cavity pressure, Pa, and volume, m^3; NaN if the heart moves by a formula, the target also in a circulation.
    """
    if not np.isfinite(solved).any():
        text = "No pressure-volume loop: the motion of this heart is prescribed (motion.kind), and nothing drives it."
        return style.sentence(text, height=4.2)
    figure = style.figure(8.4, 4.2)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.1, 1))[0]
    quantities = style.QUANTITIES["pressure"], style.volume(np.nanmax(solved[1]))
    _loop(left.subplots(), es, solved, target, quantities)
    axes = right.subplots(3, 1, sharex=True)
    axes[0].plot(time * 1e3, tension / 1e3, color=style.SOLVED)
    axes[0].set_ylabel("$T_{Ca}$ (kPa)")
    for panel, shown, wanted, found in zip(axes[1:], quantities, target, solved, strict=True):
        panel.plot(time * 1e3, shown.factor * wanted, color=style.TARGET, linewidth=4)
        panel.plot(time * 1e3, shown.factor * found, color=style.SOLVED)
        panel.set_ylabel(f"{shown.words} ({shown.unit})")
    for panel in axes:
        panel.axvline(time[es] * 1e3, color=style.MUTED, linewidth=0.9, linestyle=":")
        panel.margins(x=0.01)
    axes[0].text(time[es] * 1e3, 1.02, "ES", color=style.MUTED, ha="center", transform=axes[0].get_xaxis_transform())
    axes[2].set_xlabel("Time since end-diastole (ms)")
    right.align_ylabels()
    return figure


def _loop(axes: Axes, es: int, solved: np.ndarray, target: np.ndarray, shown: Sequence[style.Quantity]) -> None:
    factors = np.array([[quantity.factor] for quantity in shown])
    solved, target = factors * solved, factors * target
    followed = bool(np.isfinite(target).all(axis=0).any())
    curves = ((target, style.TARGET, 4, "target"), (solved, style.SOLVED, 1.6, "solved"))
    for curve, colour, width, label in curves[0 if followed else 1 :]:
        pressure, volume = np.column_stack([curve, curve[:, :1]])
        axes.plot(volume, pressure, color=colour, linewidth=width, label=label)
    for frame, name, offset in ((0, "ED", (15, 0)), (es, "ES", (-13, 8))):
        point = solved[1, frame], solved[0, frame]
        axes.plot(*point, "o", color=style.MUTED, markersize=5, zorder=5)
        look: dict[str, Any] = {"color": style.MUTED, "fontweight": "bold", "ha": "center", "va": "center"}
        axes.annotate(name, point, offset, textcoords="offset points", **look)
    y, x = (f"{quantity.words} ({quantity.unit})" for quantity in shown)
    axes.set(xlabel=x, ylabel=y, title="Pressure-volume loop")
    axes.set_ylim(bottom=0)
    axes.margins(0.1)
    if followed:
        axes.legend(loc="center")

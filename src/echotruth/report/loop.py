"""The pressure-volume loop the heart was asked for and the one it met, with the tension that drives it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from echotruth.report import style

UL = 1e-9
"""m^3."""


@style.styled
def draw(path: str | Path, time: np.ndarray, es: int, tension: np.ndarray, met: np.ndarray, asked: np.ndarray) -> Path:
    """Draw the loop and its course in time, or say that there is none.

    Parameters
    ----------
    path : str or Path
        Picture to write.
    time : ndarray of shape (frame,)
        Since end-diastole, s.
    es : int
        Frame of end-systole.
    tension : ndarray of shape (frame,)
        Active tension T_Ca, Pa.
    met, asked : ndarray of shape (2, frame)
        Cavity pressure, Pa, and volume, m^3; not a number where the heart moves by a formula.

    Returns
    -------
    Path
        The picture.
    """
    sheet = style.figure(8.4, 4.2)
    if not np.isfinite(met).any():
        words = "No pressure-volume loop: this heart moves by a formula (motion.kind), and nothing drives it."
        sheet.text(0.5, 0.5, words, ha="center", va="center", color="#555555")
        return style.save(sheet, path)
    left, right = sheet.subfigures(1, 2, width_ratios=(1.1, 1))
    _loop(left.subplots(), es, met, asked)
    axes = right.subplots(3, 1, sharex=True)
    axes[0].plot(time * 1e3, tension / 1e3, color=style.MET)
    axes[0].set_ylabel("$T_{Ca}$ (kPa)")
    for panel, name, unit, k in ((axes[1], "Pressure (mmHg)", style.MMHG, 0), (axes[2], "Volume (µL)", UL, 1)):
        panel.plot(time * 1e3, asked[k] / unit, color=style.ASKED, linewidth=4)
        panel.plot(time * 1e3, met[k] / unit, color=style.MET)
        panel.set_ylabel(name)
    for panel in axes:
        panel.axvline(time[es] * 1e3, color=style.RADIAL, linewidth=0.9, linestyle=":")
        panel.margins(x=0.01)
    axes[0].text(time[es] * 1e3, 1.02, "ES", color=style.RADIAL, ha="center", transform=axes[0].get_xaxis_transform())
    axes[2].set_xlabel("Time since end-diastole (ms)")
    right.align_ylabels()
    return style.save(sheet, path)


def _loop(axes: Axes, es: int, met: np.ndarray, asked: np.ndarray) -> None:
    for (pressure, volume), colour, width, label in (
        (asked, style.ASKED, 4, "asked"),
        (met, style.MET, 1.6, "met"),
    ):
        closed = np.r_[np.arange(len(volume)), 0]
        axes.plot(volume[closed] / UL, pressure[closed] / style.MMHG, color=colour, linewidth=width, label=label)
    for frame, name, offset in ((0, "ED", (15, 0)), (es, "ES", (-13, 8))):
        style.mark(axes, (met[1, frame] / UL, met[0, frame] / style.MMHG), name, offset)
    axes.set(xlabel="Volume (µL)", ylabel="Pressure (mmHg)", title="Pressure-volume loop")
    axes.set_ylim(bottom=0)
    axes.margins(0.1)
    axes.legend(loc="center")

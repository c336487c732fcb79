"""Motion of the heart over the cycle, beside what was measured in animals and people."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from echotruth.report import style

Published = dict[str, tuple[float, float]]

PUBLISHED: dict[str, Published] = {
    "mouse": {
        "twist": (5.6, 0.9),
        "RR": (29.0, 17.0),
        "CC": (-13.0, 3.0),
        "LL": (-18.0, 14.0),
        "RC": (0.0, 8.0),
        "RL": (4.0, 12.0),
        "CL": (3.0, 7.0),
    },
    "human": {"twist": (7.7, 3.5), "CC": (-17.0, 1.9), "LL": (-18.3, 1.8)},
}
"""Species -> mean and standard deviation at end-systole of the twist (deg) and of strains since end-diastole (%).

Mouse: Zhong et al., J Cardiovasc Magn Reson 13 (2011) 83, doi 10.1186/1532-429X-13-83, n = 7; its torsion is
normalised. Human: peak twist of 113 volunteers, Takeuchi et al., J Am Soc Echocardiogr 19 (2006) 1077, doi
10.1016/j.echo.2006.04.011; E_CC by the prediction interval of -20.8 to -13.2 % of women aged 45 to 59, Venkatesh et
al., J Magn Reson Imaging 42 (2015) 153, doi 10.1002/jmri.24749; E_LL = e + e^2 / 2 of the GLS e = -20.4 +- 2.2 % of
501 people, PMC5234340.
"""

NORMAL, SHEAR = ("RR", "CC", "LL"), ("RC", "RL", "CL")
COMPONENTS = NORMAL + SHEAR
"""Strains in the order of the arrays."""

LEVELS = ("basal", "upper", "middle", "lower", "apical")
"""Of the wall, in the order of the arrays."""

HEADROOM = 0.06
"""Room above the curves for the names of phases, over the height of the others."""
_MM = 1e-3

Cycle = dict[str, NDArray[Any]]
"""Arrays of the groups `mechanics`, `kinematics` and `physiology` of one heart, and `time`, (frame,), s.

The pressure and the volume of a prescribed motion are not numbers, and nor are the durations of phases that it lacks.
"""


@style.styled
def draw(cycle: Cycle, published: Published) -> Figure:
    """Draw rotation, strain, at end-systole also by level from base to apex, axial motion, pressure and volume.

    `published` is an entry of `PUBLISHED`, or empty.
    """
    figure = style.figure(11.4, 6.2)
    panels = figure.subplots(2, 4)
    (turn, normal, shear, levels), (axial, pressure, volume, legend) = panels
    _rotations(turn, cycle, published)
    _strains(normal, cycle, NORMAL, published)
    _strains(shear, cycle, SHEAR, published)
    _axial_motion(axial, cycle)
    _curve(pressure, cycle, cycle["pressure"], style.QUANTITIES["pressure"])
    _curve(volume, cycle, cycle["volume"], style.volume(np.nanmax(cycle["volume"], initial=0.0)))
    for panel, title in zip((turn, normal, shear, axial, pressure, volume), _TITLES, strict=True):
        panel.set_title(title, loc="left")
        panel.set_xlabel("Time since end-diastole (ms)")
        _phases(panel, cycle)
    _levels(levels, cycle)
    _explain(legend, published)
    return figure


_TITLES = ("Rotation", "Normal strain", "Shear strain", "Axial motion", "Pressure", "Volume")


def _levels(axes: Axes, cycle: Cycle) -> None:
    """Strain of the levels at end-systole, the basal one on the left."""
    es = cycle["es_frame"]
    shown = {name: cycle["level_strain"][es, :, COMPONENTS.index(name)] for name in ("CC", "LL")}
    shown["ff"] = cycle["level_fibre_strain"][es]
    for name, values in shown.items():
        quantity = style.QUANTITIES[name]
        axes.plot(LEVELS, quantity.factor * values, "o-", color=quantity.colour, markersize=4, label=quantity.tex)
    axes.axhline(0, color=style.MUTED, linewidth=0.6)
    axes.set_title("By level at end-systole", loc="left")
    axes.set_ylabel("Mean since end-diastole (%)")
    axes.tick_params(axis="x", labelsize=8)
    _finish(axes, 0.1)


def _explain(axes: Axes, published: Published) -> None:
    """What marks mean that stand in several panels."""
    axes.axis("off")
    marks = [
        Patch(color=style.SHADE, label="isovolumic contraction (IVC)\nand relaxation (IVR)"),
        Line2D(
            [],
            [],
            color=style.MUTED,
            linewidth=0.9,
            linestyle=":",
            label="end-systole (ES), of which\nlegends give the values",
        ),
    ]
    if published:
        bar = Line2D(
            [],
            [],
            color=style.MUTED,
            linewidth=5,
            alpha=0.35,
            solid_capstyle="butt",
            label="measured in animals or people,\nmean ± standard deviation",
        )
        ring = Line2D(
            [], [], color=style.MUTED, marker="o", ls="none", fillstyle="none", label="measured at the end of IVC"
        )
        marks += [bar, ring]
    axes.legend(handles=marks, loc="center left", fontsize=8, labelspacing=1.1)


def _rotations(axes: Axes, cycle: Cycle, published: Published) -> None:
    for name, values in (("base", "rotation_base"), ("apex", "rotation_apex"), ("twist", "twist")):
        _line(axes, cycle, name, style.FACTORS["°"] * cycle[values], style.QUANTITIES[name].colour)
    _measured(axes, cycle, ("twist",), published)
    axes.set_ylabel("Counter-clockwise from apex (°)")
    _finish(axes, 0.1)


def _strains(axes: Axes, cycle: Cycle, names: tuple[str, ...], published: Published) -> None:
    for name in names:
        quantity, number = style.QUANTITIES[name], COMPONENTS.index(name)
        _line(axes, cycle, quantity.tex, quantity.factor * cycle["strain_mean"][:, number], quantity.colour)
    _measured(axes, cycle, names, published)
    axes.set_ylabel("Wall mean since end-diastole (%)")
    _finish(axes, 0.1)


def _axial_motion(axes: Axes, cycle: Cycle) -> None:
    for name in ("base", "apex"):
        _line(axes, cycle, name, cycle[f"{name}_motion"] / _MM, style.QUANTITIES[name].colour, decimals=2)
    axes.set_ylabel("Towards the base (mm)")
    _finish(axes, 0.01)


def _line(axes: Axes, cycle: Cycle, name: str, values: np.ndarray, colour: str, decimals: int = 1) -> None:
    """Draw a curve, whose label has its value at end-systole."""
    at_es = float(values[cycle["es_frame"]])
    label = f"{name} {at_es:+z.{decimals}f}".replace("-", "−")  # z: not -0
    axes.plot(cycle["time"] * 1e3, values, color=colour, label=label)


def _curve(axes: Axes, cycle: Cycle, values: np.ndarray, quantity: style.Quantity) -> None:
    axes.set_ylabel(f"{quantity.words} ({quantity.unit})")
    if not np.isfinite(values).any():
        axes.text(0.5, 0.5, "none: the motion is prescribed", color=style.MUTED, ha="center", transform=axes.transAxes)
        axes.set_yticks([])
        return
    axes.plot(cycle["time"] * 1e3, quantity.factor * values, color=style.SOLVED)
    axes.set_ylim(0, 1.15 * quantity.factor * np.max(values))


def _measured(axes: Axes, cycle: Cycle, names: tuple[str, ...], published: Published) -> None:
    """Bars of mean and standard deviation beside end-systole, and a circle at 0 at the end of IVC."""
    step, end = 0.045 * 1e3 * cycle["time"][-1], 1e3 * cycle["time"][cycle["es_frame"]]
    shown = [name for name in names if name in published]
    for k, name in enumerate(shown):
        (mean, sd), colour = published[name], style.QUANTITIES[name].colour
        at = end + (k - (len(shown) - 1) / 2) * step
        axes.plot([at, at], [mean - sd, mean + sd], color=colour, linewidth=5, alpha=0.35, solid_capstyle="butt")
        axes.plot(at, mean, "_", color=colour, markersize=7, markeredgewidth=1.6)
    if shown and np.isfinite(cycle["ivc_time"]):
        axes.plot(1e3 * cycle["ivc_time"], 0, "o", color=style.MUTED, markersize=6, markerfacecolor="none", zorder=5)


def _phases(axes: Axes, cycle: Cycle) -> None:
    """Shade the isovolumic phases and mark end-systole."""
    axes.axhline(0, color=style.MUTED, linewidth=0.6)
    axes.margins(x=0.01)
    top = axes.get_xaxis_transform()
    end = float(1e3 * cycle["time"][cycle["es_frame"]])
    axes.axvline(end, color=style.MUTED, linewidth=0.9, linestyle=":")
    axes.text(end, 0.985, "ES ", color=style.MUTED, fontsize=7, ha="right", va="top", transform=top)
    opening, closing, mitral = 1e3 * np.cumsum([cycle[name] for name in ("ivc_time", "ejection_time", "ivr_time")])
    if not np.isfinite(mitral):
        return
    for name, start, stop in (("IVC", 0, opening), ("IVR", closing, mitral)):
        axes.axvspan(start, stop, color=style.SHADE, zorder=0, linewidth=0)
        look: dict[str, Any] = {"color": style.MUTED, "fontsize": 6.5, "va": "top", "textcoords": "offset points"}
        axes.annotate(name, (start, 0.985), (2, 0), xycoords=top, **look)


def _finish(axes: Axes, smallest: float) -> None:
    """Give the axis a smallest limit to both sides, lest it show rounding errors, and values at ES below it."""
    low, high = axes.get_ylim()
    low, high = min(low, -smallest), max(high, smallest)
    axes.set_ylim(low, high + HEADROOM * (high - low))
    spaces: dict[str, Any] = {"columnspacing": 0.9, "handlelength": 1, "handletextpad": 0.5, "borderaxespad": 0.2}
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, fontsize=8, **spaces)

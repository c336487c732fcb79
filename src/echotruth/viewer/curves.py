"""Curves of a clip and of its heart over the cycle: strain and rotation, tracked and true, and the volume."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from echotruth.arrays import Floats
from echotruth.evaluation.no_estimate import reason
from echotruth.report import style
from echotruth.viewer.clip import Clip

LINE = "line"
"""In place of a component: the strain of a contour, which is GCS in a short axis and GLS in a long one."""
MEASURES = {"engineering": "engineering strain, L / L0 - 1", "green_lagrange": "Green-Lagrange strain"}
WALL, MIDDLE = "wall", "middle"
CONTOURS = ("endocardial", MIDDLE, "epicardial")
TRUE = "true"
"""Name of the true curve."""


@dataclass(frozen=True)
class Plot:
    """Curves over one axis.

    Attributes
    ----------
    title : str
        Of the values, with their unit.
    curves : dict
        Name -> values, (frame,); NaN where unknown.
    """

    title: str
    curves: dict[str, Floats]


def strain(clip: Clip, found: dict[str, xr.Dataset], component: str, measure: str, part: str) -> Plot:
    """Strain over the cycle, tracked and true, %.

    Parameters
    ----------
    clip : Clip
    found : dict
        Tracker -> its curves, as :meth:`echotruth.Repository.curves` gives them.
    component : {"line", "RR", "TT", "RT"}
    measure : {"engineering", "green_lagrange"}
        Ignored for the strain of a contour, which is an engineering strain.
    part : str
        One of :func:`parts`.
    """
    kind, _, number = part.partition(" ")
    name, dim = {LINE: ("line_strain", "contour"), "segment": ("segment_strain", "aha")}.get(
        LINE if component == LINE else kind, ("region_strain", "region")
    )
    chosen = {dim: part if component == LINE else int(number or 0), "measure": measure, "wall_component": component}
    shear = component == "RT" and measure == "engineering"
    unit = "°" if shear else "%"
    return Plot(f"{strain_name(clip, component)} ({unit})", _tracked_and_true(found, name, style.FACTORS[unit], chosen))


def no_estimate(clip: Clip, plot: Plot, tracker: str, failure: str) -> str:
    """Why a tracker has no curve of strain after end-diastole; empty if it has a value in any frame.

    Parameters
    ----------
    clip : Clip
    plot : Plot
        As :func:`strain` makes it.
    tracker : str
    failure : str
        Why the tracker failed on the clip; "" if it did not.
    """
    tracked, true = plot.curves[tracker][1:], plot.curves[TRUE][1:]
    if np.isfinite(tracked).any():
        return ""
    return reason(tracked, true, clip.config, failure)


def rotation(clip: Clip, found: dict[str, xr.Dataset]) -> Plot:
    """Rotation of a short axis, tracked and true; the twist of the heart in a long axis; degrees."""
    if clip.is_short_axis and found:
        return Plot("rotation in this view (°)", _tracked_and_true(found, "rotation", style.FACTORS["°"], {}))
    heart = clip.of_heart("physiology", "rotation_base", "rotation_apex", "twist")
    shown = {name.removeprefix("rotation_"): style.FACTORS["°"] * values for name, values in heart.items()}
    return Plot("rotation, base and apex, and twist (°)", shown)


def volume(clip: Clip) -> Plot:
    """Volume of the cavity, µL or mL."""
    values = clip.of_heart("mechanics", "volume").get("volume", np.full(clip.frames, np.nan))
    quantity = style.volume(float(np.nanmax(values, initial=0.0)))
    return Plot(quantity.plain, {TRUE: quantity.factor * values})


def parts(clip: Clip, component: str, segments: list[int]) -> list[str]:
    """Parts of the wall of which there are curves: contours, or the wall, its layers and the segments of the view."""
    if component == LINE:
        return list(CONTOURS)
    layers = range(1, clip.config.fibres.layers + 1)
    return [WALL, *(f"layer {number}" for number in layers), *(f"segment {number}" for number in segments)]


def strain_name(clip: Clip, component: str) -> str:
    """A strain in words, as echocardiography has it."""
    plane = "short_axis" if clip.is_short_axis else "long_axis"
    direction = style.QUANTITIES[style.ALONG[plane]].words.lower()
    names = {LINE: f"{style.GLOBAL[plane]}, strain of a contour", "RR": "radial strain", "TT": direction}
    return (names | {"RT": "shear"})[component]


def segments(found: xr.Dataset) -> list[int]:
    """AHA segments that the view shows."""
    strain = found["true_segment_strain"].isel(measure=0, wall_component=0).transpose("frame", "aha").values
    return [int(number) for number in found["aha"].values[np.isfinite(strain).any(axis=0)]]


def _tracked_and_true(
    found: dict[str, xr.Dataset], name: str, factor: float, chosen: dict[str, str | int]
) -> dict[str, Floats]:
    """The true curve, and that of every tracker; the truth is the same for all."""
    curves: dict[str, Floats] = {}
    for tracker, data in found.items():
        true, tracked = (data[f"{kind}_{name}"] for kind in ("true", "tracked"))
        pick = {dim: value for dim, value in chosen.items() if dim in true.dims}
        curves |= {TRUE: factor * true.sel(pick).values, tracker: factor * tracked.sel(pick).values}
    return curves

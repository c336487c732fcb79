"""Curves as tidy CSV: one row a frame, tracker and quantity, and a table of what is read off them."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from echotruth.arrays import Floats
from echotruth.fem.volume import cell_volumes
from echotruth.repository.estimates import NotEvaluated
from echotruth.sharing.export.clip import ExportedClip

COMPONENTS = ("RR", "CC", "LL")
"""Of the heart's strain: radial, circumferential, longitudinal."""

CURVES = {
    "pressure": ("mechanics", "pressure", 1e-3, "kPa"),
    "volume": ("mechanics", "volume", 1e9, "uL"),
    "active_tension": ("mechanics", "active_tension", 1e-3, "kPa"),
    "rotation_base": ("physiology", "rotation_base", np.degrees(1), "degree"),
    "rotation_apex": ("physiology", "rotation_apex", np.degrees(1), "degree"),
    "twist": ("physiology", "twist", np.degrees(1), "degree"),
    "apex_motion": ("physiology", "apex_motion", 1e6, "um"),
    "base_motion": ("physiology", "base_motion", 1e6, "um"),
}
"""Quantity -> group and array of the heart, factor from SI to the unit, and the unit."""

COLUMNS = (
    *("case", "view", "size_px", "tracker", "quantity", "measure", "place", "component", "frame", "time_ms"),
    *("tracked", "true", "unit"),
)
"""Columns of the curves."""


def write(clip: ExportedClip, path: Path, trackers: Sequence[str]) -> None:
    """Write the curves of the heart, and what each tracker found in the clip beside its truth.

    Empty cells are unknown: the pressure of a prescribed motion, or a segment that a view does not show. The tracker of
    the heart's own curves is empty.

    Parameters
    ----------
    clip : ExportedClip
    path : Path
    trackers : sequence of str
        Those that were not run on the clip are left out.
    """
    parts = [*_heart(clip), *_heart_strain(clip)]
    for tracker in trackers:
        with suppress(NotEvaluated):
            curves = clip.repository.curves(clip.case.id, clip.view, tracker, clip.size)
            parts += [part.assign(tracker=tracker) for part in _tracked(curves)]
    table = pd.concat(parts, ignore_index=True)
    table = table.assign(case=clip.case.id, view=clip.view, size_px=clip.size)
    table["time_ms"] = 1e3 * clip.time[table["frame"].to_numpy()]
    table[list(COLUMNS)].to_csv(path, index=False, float_format="%.9g", lineterminator="\n")


def write_summary(clips: Sequence[ExportedClip], path: Path, trackers: Sequence[str]) -> None:
    """Write the table of :meth:`echotruth.Repository.summary` of some clips.

    Parameters
    ----------
    clips : sequence of ExportedClip
        Of one repository.
    path : Path
    trackers : sequence of str
    """
    found = zip(*((clip.case.id, clip.view, clip.size) for clip in clips), strict=True)
    cases, views, sizes = (list(dict.fromkeys(names)) for names in found)
    table = clips[0].repository.summary(cases, views, sizes, trackers)
    table.to_csv(path, index=False, float_format="%.9g", lineterminator="\n")


def _rows(true: Floats, unit: str, **about: str) -> pd.DataFrame:
    """Rows of one curve of the heart."""
    about = dict.fromkeys(("measure", "place", "component", "tracker"), "") | about
    return pd.DataFrame({"frame": np.arange(len(true)), "true": true, "tracked": np.nan, "unit": unit, **about})


def _heart(clip: ExportedClip) -> Iterator[pd.DataFrame]:
    for quantity, (group, array, factor, unit) in CURVES.items():
        yield _rows(factor * clip.repository.arrays(group, clip.case.id, None, array)[array], unit, quantity=quantity)


def _heart_strain(clip: ExportedClip) -> Iterator[pd.DataFrame]:
    """Green-Lagrange strain of the wall and of its segments since end-diastole, %."""
    found = clip.repository.arrays("kinematics", clip.case.id, None, "strain", "strain_mean")
    strain, wall = found["strain"], found["strain_mean"]
    about = {"quantity": "heart_strain", "measure": "green_lagrange"}
    for k, component in enumerate(COMPONENTS):
        yield _rows(100 * wall[:, k], "percent", place="wall", component=component, **about)
    volume, segment = cell_volumes(clip.heart.nodes, clip.heart.cells), clip.heart.arrays["fibres"]["segment"]
    for number in range(1, 18):
        share = np.where(segment == number, volume, 0.0)
        for k, component in enumerate(COMPONENTS):
            mean = strain[..., k] @ (share / share.sum()) if share.any() else np.full(len(strain), np.nan)
            yield _rows(100 * mean, "percent", place=f"segment_{number:02d}", component=component, **about)


def _tracked(curves: xr.Dataset) -> Iterator[pd.DataFrame]:
    """Rows of the strain and the rotation in the view; strain in %, angles in degrees."""
    places = {"region": lambda number: f"layer_{number}" if number else "wall", "aha": "segment_{:02d}".format}
    for quantity in ("region_strain", "segment_strain", "line_strain", "rotation"):
        pair = xr.Dataset({kind: curves[f"{kind}_{quantity}"] for kind in ("tracked", "true")})
        table = pair.reset_coords(drop=True).to_dataframe().reset_index()
        for dim, name in places.items():
            if dim in table:
                table["place"] = table[dim].map(name)
        table = table.rename(columns={"contour": "place", "wall_component": "component"})
        table = table.assign(**{name: "" for name in ("measure", "place", "component") if name not in table})
        if quantity == "line_strain":
            table["measure"] = "engineering"
        angle = (quantity == "rotation") | ((table["component"] == "RT") & (table["measure"] == "engineering"))
        factor = np.where(angle, np.degrees(1), 100.0)
        table[["tracked", "true"]] *= factor[:, None]
        table["unit"] = np.where(angle, "degree", "percent")
        order = ["measure", "place", "component", "frame"]
        yield table.assign(quantity=quantity).sort_values(order, kind="stable")

"""What trackers found in one heart beside the truth: strain, rotation and twist over the cycle."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from echotruth.aha import SEGMENT_NAMES
from echotruth.cases import Case
from echotruth.config import View
from echotruth.evaluation.curves import twist_of, twist_views
from echotruth.report import style
from echotruth.report.bullseye import Segments
from echotruth.report.curves import Panel
from echotruth.repository.reader import Repository

COMPONENTS = (
    ("short_axis", "TT", "Circumferential strain, from the short-axis views"),
    ("short_axis", "RR", "Radial strain, from the short-axis views"),
    ("long_axis", "TT", "Longitudinal strain, from the long-axis views"),
)
"""Plane, component and title of the bullseyes."""


@dataclass(frozen=True)
class Comparison:
    """Curves of one heart.

    Attributes
    ----------
    repository : Repository
    case : Case
    candidates : tuple of str
        Trackers of which displacement is stored, the best first.
    """

    repository: Repository
    case: Case
    candidates: tuple[str, ...]

    @property
    def views(self) -> dict[str, View]:
        """Views by their names."""
        return self.case.config.views

    @property
    def size(self) -> int:
        """Size of the images, px: the largest."""
        return self.case.config.bmode.sizes[0]

    @cached_property
    def curves(self) -> dict[str, dict[str, xr.Dataset]]:
        """View -> tracker -> its curves and the true ones."""
        found = {}
        for name in self.candidates:
            # One from outside may have been evaluated on other clips, or before these were made.
            with suppress(ValueError):
                found[name] = {view: self.repository.curves(self.case.id, view, name) for view in self.views}
        return {view: {name: of_views[view] for name, of_views in found.items()} for view in self.views}

    @property
    def trackers(self) -> list[str]:
        """Trackers that have curves of all views, the best first."""
        return list(next(iter(self.curves.values())))

    @property
    def rows(self) -> list[list[Panel | None]]:
        """Panels of the global strains and of the rotation, a column for each view; twist where there is room."""
        strains: list[list[Panel | None]] = [[], []]
        turns: list[Panel | None] = []
        whole = {"measure": "engineering", "region": 0, "wall_component": "RR"}
        for view, settings in self.views.items():
            found, title = self.curves[view], f"{style.title(view)}\n{strain_of_line(settings.plane)}"
            strains[0].append(_panel(title, "%", found, "line_strain", {"contour": "middle"}))
            strains[1].append(_panel("Radial strain in the plane", "%", found, "region_strain", whole))
            is_short = settings.plane == "short_axis"
            turns.append(_panel("Rotation", "°", found, "rotation", {}) if is_short else None)
        if twist := self.twist:
            place = turns.index(None) if None in turns else len(turns)
            for row in (*strains, turns) if place == len(turns) else ():
                row.append(None)
            turns[place] = twist
        return [*strains, *([turns] if any(turns) else [])]

    @property
    def twist(self) -> Panel | None:
        """Twist; none with fewer than two short-axis views."""
        views = twist_views(self.case.config)
        if views is None:
            return None
        base, apex = (self.curves[view] for view in views)
        found = {name: twist_of(base[name], apex[name]) for name in self.trackers}
        return _panel("Twist, apex less base", "°", found, "twist", {})

    def segments(self, view: str, tracker: str) -> list[list[Panel | None]]:
        """Panels of the strain along the wall of the segments of a view, three in a row.

        The strain is circumferential in a short axis and longitudinal in a long axis.
        """
        data, chosen = self.curves[view][tracker], {"measure": "engineering", "wall_component": "TT"}
        known = data["true_segment_strain"].sel(chosen).notnull().any("frame").values
        panels: list[Panel | None] = []
        for number in data.aha.values[known].tolist():
            title, place = f"{number} {SEGMENT_NAMES[number - 1]}", chosen | {"aha": number}
            panels.append(_panel(title, "%", {tracker: data}, "segment_strain", place))
        panels += [None] * (-len(panels) % 3)
        return [panels[k : k + 3] for k in range(0, len(panels), 3)]

    def bullseyes(self, tracker: str) -> list[Segments]:
        """Strain of the segments at end-systole, true and of a tracker, for each component that a view shows."""
        found = []
        for plane, component, title in COMPONENTS:
            if views := [name for name, view in self.views.items() if view.plane == plane]:
                true, tracked = (self._segments_at_es(views, tracker, name, component) for name in ("true", "tracked"))
                found.append(Segments(title, true, tracked))
        return found

    def _segments_at_es(self, views: list[str], tracker: str, name: str, component: str) -> NDArray[np.float64]:
        """Strain of segments 1..17 at end-systole, %; where two views show a segment, their mean."""
        columns = []
        for view in views:
            data = self.curves[view][tracker]
            strain = data[f"{name}_segment_strain"].sel(measure="engineering", wall_component=component)
            columns.append(style.FACTORS["%"] * strain.isel(frame=int(data.attrs["es_frame"])).values)
        return pd.DataFrame(np.array(columns, float)).mean().to_numpy()  # of those that are known


def strain_of_line(plane: str) -> str:
    """Name of the strain of the mid-wall contour in a plane."""
    quantity = style.QUANTITIES[style.GLOBAL[plane]]
    return f"{quantity.words} {quantity.symbol}"


def _panel(title: str, unit: str, found: Mapping[str, xr.Dataset], name: str, selection: Mapping[str, Any]) -> Panel:
    """Panel of a curve, true and by the trackers of which data sets are given."""
    first, factor = next(iter(found.values())), style.FACTORS[unit]
    time = 1e3 * first["time"].values
    true = factor * first[f"true_{name}"].sel(selection).values
    tracked = {tracker: factor * data[f"tracked_{name}"].sel(selection).values for tracker, data in found.items()}
    return Panel(title, unit, time, float(time[first.attrs["es_frame"]]), true, tracked)

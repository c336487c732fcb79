"""Arrays of a heart and of its clips as xarray data sets, with the dimensions and units of the repository."""

from __future__ import annotations

from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from echotruth.cases import Case
from echotruth.config.building import configure
from echotruth.evaluation.clip import grid_points
from echotruth.heart import Heart
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import read_loop
from echotruth.repository import schema

if TYPE_CHECKING:
    import xarray as xr


def heart_dataset(heart: Heart, group: str) -> xr.Dataset:
    """Arrays of one group of a heart.

    Parameters
    ----------
    heart : Heart
        As :func:`echotruth.beat` returns it.
    group : {"geometry", "fibres", "pathology", "mechanics", "kinematics", "physiology"}

    Raises
    ------
    ValueError
        If the heart has no such group.
    """
    if heart.config is None or group not in heart.arrays:
        raise ValueError(f"group = {group!r}: the heart has {', '.join(heart.arrays) or 'no groups'}.")
    case = Case("heart", {}, heart.config)
    return dataset(case, {group: heart.arrays[group]}, {})


def clip_dataset(heart: Heart, case: Case, view: str, plane: Plane, values: dict[str, dict[str, Any]]) -> xr.Dataset:
    """Clip of one image size with its truth, and all that :func:`echotruth.track` and `evaluate` need.

    Parameters
    ----------
    heart : Heart
    case : Case
    view : str
        Name of the view.
    plane : Plane
    values : dict of dict of ndarray
        Groups `bmode/SIZE` and `truth/SIZE`, and `rf` where lines are kept.
    """
    bmode = case.config.bmode
    size, largest = int(next(iter(values)).rpartition("/")[2]), bmode.sizes[0]
    axial, lateral = pixel_centres(bmode, size)
    found = dataset(case, values, {"axial": axial, "lateral": lateral})
    index = grid_points(case.config, largest).round().astype(int)
    axial, lateral = (axis[index[..., k]] for axis, k in zip(pixel_centres(bmode, largest), (1, 0), strict=True))
    at_ed = pixel_truth(_at_ed(heart), plane, axial[:, 0], lateral[0])["mask"][0]
    about = {"long_name": "whether a point that trackers follow is in the wall at ED", "units": "1"}
    points = {"grid_mask": (("grid_axial", "grid_lateral"), at_ed, about)}
    found = found.assign(points).assign_coords(grid_axial=axial[:, 0], grid_lateral=lateral[0])
    return found.assign_attrs(
        case=case.id,
        view=view,
        plane_origin=plane.origin.tolist(),
        plane_axes=plane.axes.ravel().tolist(),
        heart=fingerprint(heart),
        config=case.config.model_dump_json(),
    )


def dataset(case: Case, groups: dict[str, dict[str, Any]], coordinates: dict[str, np.ndarray]) -> xr.Dataset:
    """Arrays of one case, or of one of its views, with the dimensions, units and meanings of the repository."""
    import xarray as xr

    found, arrays = {}, schema.groups(case.config)
    for group, values in groups.items():
        for array in arrays[group]:
            if array.name in values:
                dims = [dim for dim in array.dims if dim not in ("case", "view", "tracker")]
                about = {"units": array.units, "long_name": array.long_name}
                found[array.name] = (dims, np.asarray(values[array.name], array.dtype), about)
    data, labels = xr.Dataset(found), schema.LABELS | coordinates
    data = data.assign_coords({name: (name, np.asarray(labels[name])) for name in data.dims if name in labels})
    if "frame" in data.dims:
        data = data.assign_coords(time=("frame", read_loop(case.config.loop).time, {"units": "s"}))
    return data


def case_of(clip: xr.Dataset) -> Case:
    """The case that a clip, or what was tracked in it, belongs to.

    Raises
    ------
    ValueError
        If the data set has lost its attributes.
    """
    missing = [name for name in ("case", "config", "view", "plane_origin", "plane_axes") if name not in clip.attrs]
    if missing:
        raise ValueError(f"The data set has lost its attribute {missing[0]}: keep those that echotruth.image gave it.")
    import json

    return Case(clip.attrs["case"], {}, configure(json.loads(clip.attrs["config"])))


def fingerprint(heart: Heart) -> str:
    """Twelve hexadecimal digits that tell one motion from another."""
    return sha256(np.ascontiguousarray(heart.displacement).tobytes()).hexdigest()[:12]


def _at_ed(heart: Heart) -> Heart:
    """The heart in its first frame alone."""
    from dataclasses import replace

    return replace(heart, displacement=heart.displacement[:1])

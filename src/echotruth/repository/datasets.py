"""Arrays of a heart and of its clips as xarray data sets, with the dimensions and units of the repository."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from echotruth.cases import Case
from echotruth.config.building import configure
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.view import Plane, moved
from echotruth.loop.cycle import frame_times
from echotruth.repository import rounding, schema
from echotruth.repository.derived import derived
from echotruth.tracking.point_grid import grid_positions

if TYPE_CHECKING:
    import xarray as xr

VOLUME = ("axial", "elevation", "lateral")
"""Dimensions of a volume, in the order of its voxels."""

SOURCE = ("plane_origin", "plane_axes", "motion")
"""Attributes of a clip, and of its truth in a repository, that say of what it is the image."""


def clip_dataset(
    case: Case, view: str, values: dict[str, dict[str, Any]], inside: NDArray[np.bool_], source: dict[str, Any]
) -> xr.Dataset:
    """Clip of one image size with its truth, and all that :func:`echotruth.track` and `evaluate` need.

    Parameters
    ----------
    case : Case
    view : str
        Name of the view.
    values : dict of dict of ndarray
        Groups `bmode/SIZE` and `truth/SIZE`, or some of their arrays.
    inside : ndarray of shape (grid rows, grid columns), bool
        Which points of the trackers' grid are in the wall at end-diastole.
    source : dict
        As :func:`source_of` returns it.
    """
    axial, lateral = pixel_centres(case.config.bmode, int(next(iter(values)).rpartition("/")[2]))
    found = derived(dataset(case, values, {"axial": axial, "lateral": lateral}), case.config)
    grid = grid_positions(case.config)
    lateral, axial = grid[0, :, 0], grid[:, 0, 1]
    about = {"long_name": "whether a point that trackers follow is in the wall at ED", "units": "1"}
    points = {"grid_mask": (("grid_axial", "grid_lateral"), inside, about)}
    found = found.assign(points).assign_coords(grid_axial=axial, grid_lateral=lateral)
    return found.assign_attrs(case=case.id, view=view, **source, config=case.config.model_dump_json())


def volume_dataset(
    case: Case, view: str, images: NDArray[np.uint8], mask: NDArray[np.bool_], source: dict[str, Any]
) -> xr.Dataset:
    """Volumes (frame, axial, elevation, lateral) and the wall at end-diastole, as :func:`clip_dataset` has clips."""
    centres = dict(zip(VOLUME, voxel_centres(case.config), strict=True))
    data = dataset(case, {"bmode/volume": {"image": images}}, {**centres, "frame": np.arange(len(images))})
    about = {"units": "1", "long_name": "whether a voxel is in the wall at ED"}
    data = data.assign(mask=(VOLUME, mask, about))
    return data.assign_attrs(case=case.id, view=view, **source, config=case.config.model_dump_json())


def source_of(heart: Heart, plane: Plane) -> dict[str, Any]:
    """Attributes `SOURCE`: origin and axes of the plane, and what identifies the motion of the heart."""
    found = plane.origin.tolist(), plane.axes.ravel().tolist(), fingerprint(heart)
    return dict(zip(SOURCE, found, strict=True))


def as_stored(case: Case, groups: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Arrays of groups that were just made, rounded as a repository has them; what is read from one is so already."""
    return {
        group: {
            name: rounding.as_stored(values[name], array, case.config)
            for name, array in schema.arrays_of(group, case.config.has_volumes).items()
            if name in values
        }
        for group, values in groups.items()
    }


def dataset(case: Case, groups: dict[str, dict[str, Any]], coordinates: dict[str, np.ndarray]) -> xr.Dataset:
    """Arrays of one case, or of one of its views, with the dimensions and units of the repository."""
    import xarray as xr

    found = {}
    for group, values in groups.items():
        for array in schema.arrays_of(group, case.config.has_volumes).values():
            if array.name in values:
                dims = [dim for dim in array.dims if dim != "size"]
                about: dict[str, Any] = {"units": array.units, "long_name": array.long_name}
                step = rounding.quantum(array, case.config)
                about |= {} if step is None else {"quantum": step}
                found[array.name] = (dims, np.asarray(values[array.name], array.dtype), about)
    data, labels = xr.Dataset(found), schema.LABELS | coordinates
    data = data.assign_coords({name: (name, np.asarray(labels[name])) for name in data.dims if name in labels})
    if "frame" in data.dims:
        data = data.assign_coords(time=("frame", frame_times(case.config.loop), {"units": "s"}))
    return data


def case_of(clip: xr.Dataset) -> Case:
    """The case that a clip, or what was tracked in it, belongs to.

    Raises
    ------
    ValueError
        If the data set has lost its attributes.
    """
    missing = [name for name in ("case", "config", "view", *SOURCE[:2]) if name not in clip.attrs]
    if missing:
        raise ValueError(f"The data set has lost its attribute {missing[0]}: keep those that echotruth.image gave it.")
    return Case(clip.attrs["case"], {}, configure(json.loads(clip.attrs["config"])))


def imaged_heart(clip: xr.Dataset, heart: Heart) -> tuple[Heart, Plane]:
    """A heart as it moved before the probe of a clip, or of what was tracked in it, and the plane.

    Raises
    ------
    ValueError
        If the clip was made of another heart.
    """
    if clip.attrs.get("motion", fingerprint(heart)) != fingerprint(heart):
        raise ValueError("The clip was made of another heart: give the one that was imaged.")
    plane = Plane(np.array(clip.attrs["plane_origin"]), np.reshape(clip.attrs["plane_axes"], (3, 3)))
    config = case_of(clip).config
    return moved(heart, plane, config.views[clip.attrs["view"]].motion, config.loop), plane


def fingerprint(heart: Heart) -> str:
    """Twelve hexadecimal digits that identify a motion."""
    return sha256(np.ascontiguousarray(heart.displacement).tobytes()).hexdigest()[:12]

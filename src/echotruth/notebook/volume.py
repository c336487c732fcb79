"""Volumes: their data sets, the truth at their voxels, and what was tracked in them."""

import warnings
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.cases import Case
from echotruth.config import Config
from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.clip import tracker_seed
from echotruth.evaluation.strain import RADIUS
from echotruth.evaluation.volume import VolumePoints, metrics
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.labels import LABELS
from echotruth.imaging.truth import PixelTruth
from echotruth.loop.cycle import frame_times
from echotruth.notebook.arguments import check_clip, check_heart
from echotruth.repository import schema
from echotruth.repository.datasets import case_of, imaged_heart
from echotruth.section import Section
from echotruth.tracking.tracker import track
from echotruth.units import mm

DIMENSIONS = ("axial", "elevation", "lateral")
"""Of a volume, in the order of its voxels."""
POINT_SPACING = 0.45
"""Distance of the points that trackers follow, over the radius of the strain operator."""


def volume_dataset(
    case: Case, view: str, images: NDArray[np.uint8], mask: NDArray[np.bool_], source: dict[str, Any]
) -> xr.Dataset:
    """Volumes (frame, axial, elevation, lateral) and the wall at end-diastole, as a data set."""
    config, time = case.config, ("frame", frame_times(case.config.loop), {"units": "s"})
    data = xr.Dataset(
        {
            "image": (("frame", *DIMENSIONS), images, {"units": "1", "long_name": "B-mode"}),
            "mask": (DIMENSIONS, mask, {"units": "1", "long_name": "whether a voxel is in the wall at ED"}),
        },
        _coordinates(config) | {"frame": np.arange(len(images)), "time": time},
    )
    return data.assign_attrs(case=case.id, view=view, **source, config=config.model_dump_json())


def voxel_truth(clip: xr.Dataset, heart: Heart, frame: int) -> xr.Dataset:
    """The truth at every voxel of a volume.

    It is computed from the motion of the heart, and not stored: it takes forty times the room of the volumes.

    Parameters
    ----------
    clip : Dataset
        Volumes, as :func:`echotruth.image` returns them.
    heart : Heart
        The heart that was imaged.
    frame : int
        Frame of the cycle.

    Returns
    -------
    Dataset
        Over (axial, elevation, lateral), of the tissue that is at a voxel in that frame: displacement since
        end-diastole (m; lateral, axial, elevation), strain (RR, CC, LL, RC, RL, CL), wall_depth, layer, segment and
        region; NaN or 0 outside the wall.

    Raises
    ------
    ValueError
        If it is no volume, there is no such frame, or the heart is another one.

    Examples
    --------
    >>> import echotruth as et
    >>> clip = et.image(heart, et.View(plane="volume"), "mouse_row_column_15MHz")  # doctest: +SKIP
    >>> et.voxel_truth(clip, heart, heart.es)["displacement"].dims  # doctest: +SKIP
    ('axial', 'elevation', 'lateral', 'vector')
    """
    check_clip(clip, volumes=True)
    check_heart(heart)
    if not set(DIMENSIONS) <= set(clip.dims):
        raise ValueError("clip: is no volume: give what echotruth.image makes of a view whose plane is volume.")
    frames = len(heart.displacement)
    if isinstance(frame, bool) or not isinstance(frame, int | np.integer) or not 0 <= frame < frames:
        raise ValueError(f"frame = {frame!r}: use a whole number from 0 to {frames - 1}.")
    moving, plane = imaged_heart(clip, heart)
    axial, elevation, lateral = (clip[name].values for name in DIMENSIONS)
    truth = PixelTruth(moving, plane, axial, lateral, elevation=elevation, frames=[frame])
    named = dict(zip(LABELS, truth["labels"][0], strict=True))
    data = {
        "displacement": ((*DIMENSIONS, "vector"), truth["displacement"][0], {"units": "m"}),
        "strain": ((*DIMENSIONS, "strain_component"), truth["strain"][0], {"units": "1"}),
        "wall_depth": (DIMENSIONS, truth["wall_depth"][0], {"units": "1"}),
    } | {name: (DIMENSIONS, values, {"units": "1"}) for name, values in named.items()}
    labels = {name: list(schema.LABELS[name]) for name in ("vector", "strain_component")}
    return xr.Dataset(data, {name: clip[name] for name in DIMENSIONS} | labels | {"frame": frame})


def track_volume(clip: xr.Dataset, settings: Section) -> xr.Dataset:
    """Track the wall in volumes, as :func:`echotruth.track`.

    Returns
    -------
    Dataset
        displacement (frame, point, vector: lateral, axial, elevation), m, since end-diastole, and quality
        (frame, point), at points of the wall, whose positions at end-diastole are coordinates, m.
    """
    case = case_of(clip)
    images, mask = (clip[name].transpose(..., *DIMENSIONS).values for name in ("image", "mask"))
    if not mask.any():
        raise ValueError("clip: its mask is empty, so that there is no wall to track.")
    if any(np.take(mask, [0, -1], axis).any() for axis in range(3)):
        warnings.warn("the wall reaches a face of the volume: tissue that leaves it is not tracked right", stacklevel=3)
    if not case.config.views[clip.attrs["view"]].motion.is_closed and isinstance(settings, BsplineDic):
        settings = settings.model_copy(update={"reference": "previous"})
    voxel = np.array(case.config.volume.voxel_mm) * mm
    steps = np.maximum(1, np.rint(POINT_SPACING * _radius(case.config) / voxel)).astype(int)
    grid = np.zeros(mask.shape, bool)
    grid[tuple(slice(step // 2, None, step) for step in steps)] = True
    indices = np.argwhere(grid & mask)
    # Trackers count lateral first, as in an image, where an array has it last.
    seed, time = tracker_seed(case, clip.attrs["view"]), clip["time"].values
    found, quality = track(images, indices[:, ::-1].astype(float), mask, voxel[::-1], time, seed, settings)
    lateral, elevation, axial = np.moveaxis(found * voxel[::-1], -1, 0)
    positions = (clip[name].values[of] for name, of in zip(DIMENSIONS, indices.T, strict=True))
    return xr.Dataset(
        {
            "displacement": (("frame", "point", "vector"), np.stack([lateral, axial, elevation], -1), {"units": "m"}),
            "quality": (("frame", "point"), quality, {"units": "1"}),
        },
        {name: ("point", values, {"units": "m"}) for name, values in zip(DIMENSIONS, positions, strict=True)}
        | {"vector": list(schema.LABELS["vector"]), "frame": clip["frame"].values, "time": clip["time"]},
    ).assign_attrs(clip.attrs)


def evaluate_volume(tracked: xr.Dataset, heart: Heart) -> pd.Series:
    """Compare a motion that was tracked in volumes with that of the heart; see :func:`.evaluation.volume.metrics`.

    Raises
    ------
    ValueError
        If it is no displacement of all frames at points of the wall.
    """
    if "displacement" not in tracked or set(tracked["displacement"].dims) != {"frame", "point", "vector"}:
        raise ValueError("tracked: has no displacement (frame, point, vector): give what et.track returns.")
    moving, plane = imaged_heart(tracked, heart)
    frames = np.arange(len(heart.displacement))
    if not np.array_equal(tracked["frame"].values, frames):
        raise ValueError(f"tracked: must have the frames 0 to {frames[-1]} of the heart, in their order.")
    points = VolumePoints(moving, plane, tracked_positions(tracked), _radius(case_of(tracked).config))
    if beside := int((~points.is_in_wall).sum()):
        raise ValueError(f"tracked: {beside} of its points are not in the wall at end-diastole: leave them out.")
    displacement = tracked["displacement"].sel(vector=list(schema.LABELS["vector"]))
    found = metrics(displacement.transpose("frame", "point", "vector").values, points, heart.es)
    return pd.Series(found, name=tracked.attrs.get("tracker"))


def tracked_positions(tracked: xr.Dataset) -> Floats:
    """Points at end-diastole of what was tracked in volumes, (point, 3), m: lateral, axial, elevation."""
    return np.column_stack([tracked[name].values for name in schema.LABELS["vector"]])


def _radius(config: Config) -> float:
    """Radius of the strain operator, m: that in the image of a slice."""
    return RADIUS * config.bmode.field_of_view_mm * mm


def _coordinates(config: Config) -> dict[str, tuple[str, Floats, dict[str, str]]]:
    centres = zip(DIMENSIONS, voxel_centres(config), strict=True)
    return {name: (name, values, {"units": "m"}) for name, values in centres}

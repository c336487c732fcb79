"""Volumes: the truth at their voxels, and what was tracked in them."""

import warnings

import numpy as np
import pandas as pd
import xarray as xr

from echotruth.arrays import Floats
from echotruth.evaluation.volume import VolumeClip, VolumePoints, metrics, strain_radius
from echotruth.heart import Heart
from echotruth.imaging.labels import LABELS
from echotruth.imaging.truth import PixelTruth
from echotruth.notebook.arguments import check_clip, check_heart
from echotruth.repository import schema
from echotruth.repository.datasets import VOLUME, as_stored, case_of, dataset, imaged_heart
from echotruth.section import Section
from echotruth.tracking.tracker import track


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
    if not set(VOLUME) <= set(clip.dims):
        raise ValueError("clip: is no volume: give what echotruth.image makes of a view whose plane is volume.")
    frames = len(heart.displacement)
    if isinstance(frame, bool) or not isinstance(frame, int | np.integer) or not 0 <= frame < frames:
        raise ValueError(f"frame = {frame!r}: use a whole number from 0 to {frames - 1}.")
    moving, plane = imaged_heart(clip, heart)
    axial, elevation, lateral = (clip[name].values for name in VOLUME)
    truth = PixelTruth(moving, plane, axial, lateral, elevation=elevation, frames=[frame])
    named = dict(zip(LABELS, truth["labels"][0], strict=True))
    data = {
        "displacement": ((*VOLUME, "vector"), truth["displacement"][0], {"units": "m"}),
        "strain": ((*VOLUME, "strain_component"), truth["strain"][0], {"units": "1"}),
        "wall_depth": (VOLUME, truth["wall_depth"][0], {"units": "1"}),
    } | {name: (VOLUME, values, {"units": "1"}) for name, values in named.items()}
    labels = {name: list(schema.LABELS[name]) for name in ("vector", "strain_component")}
    return xr.Dataset(data, {name: clip[name] for name in VOLUME} | labels | {"frame": frame})


def track_volume(clip: xr.Dataset, settings: Section) -> xr.Dataset:
    """Track the wall in volumes, as :func:`echotruth.track`.

    Returns
    -------
    Dataset
        displacement (frame, point, vector: lateral, axial, elevation), m, since end-diastole, and quality
        (frame, point), at points of the wall, whose positions at end-diastole are coordinates, m.
    """
    volumes = volume_clip(clip)
    case, mask = volumes.case, volumes.mask
    if not mask.any():
        raise ValueError("clip: its mask is empty, so that there is no wall to track.")
    if any(np.take(mask, [0, -1], axis).any() for axis in range(3)):
        warnings.warn("the wall reaches a face of the volume: tissue that leaves it is not tracked right", stacklevel=3)
    found = volumes.arrays(*track(*volumes.tracker_arguments, volumes.suited(settings)))
    arrays = dataset(case, as_stored(case, {"tracking/TRACKER": found}), {"frame": clip["frame"].values})
    positions = zip(schema.LABELS["vector"], volumes.positions.T, strict=True)
    return arrays.assign_coords({name: ("point", at, {"units": "m"}) for name, at in positions}).assign_attrs(
        clip.attrs
    )


def volume_clip(clip: xr.Dataset) -> VolumeClip:
    """Volumes as trackers receive them."""
    images, mask = (clip[name].transpose(..., *VOLUME).values for name in ("image", "mask"))
    return VolumeClip(case_of(clip), clip.attrs["view"], images, mask)


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
    points = VolumePoints(moving, plane, tracked_positions(tracked), strain_radius(case_of(tracked).config))
    if beside := int((~points.is_in_wall).sum()):
        raise ValueError(f"tracked: {beside} of its points are not in the wall at end-diastole: leave them out.")
    displacement = tracked["displacement"].sel(vector=list(schema.LABELS["vector"]))
    found = metrics(displacement.transpose("frame", "point", "vector").values, points, heart.es)
    return pd.Series(found, name=tracked.attrs.get("tracker"))


def tracked_positions(tracked: xr.Dataset) -> Floats:
    """Points at end-diastole of what was tracked in volumes, (point, 3), m: lateral, axial, elevation."""
    return np.column_stack([tracked[name].values for name in schema.LABELS["vector"]])

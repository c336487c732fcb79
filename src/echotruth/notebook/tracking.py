"""From a clip to a tracked motion, and from that to a score."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from echotruth.config.building import tracker_section
from echotruth.evaluation.clip import Clip, tracker_seed
from echotruth.evaluation.points import truth_at
from echotruth.evaluation.scoring import metrics, score
from echotruth.heart import Heart
from echotruth.notebook.arguments import check_clip, check_heart, check_whole, is_volume
from echotruth.repository.datasets import as_stored, case_of, dataset, imaged_heart
from echotruth.tracking.plausibility import doubts
from echotruth.tracking.point_grid import grid_points
from echotruth.tracking.tracker import track as track_points
from echotruth.units import mm


def track(clip: xr.Dataset, tracker: str | Callable[..., Any] = "bspline_dic", **options: Any) -> xr.Dataset:
    """Track the wall in a clip.

    Parameters
    ----------
    clip : Dataset
        A whole cycle, as :func:`echotruth.image` or :meth:`echotruth.Repository.clip` returns it. The tracker sees
        `image`, and the wall at end-diastole.
    tracker : str or callable
        Name of a tracker of the configuration, of a method (config/README.md, `tracking.trackers`), or
        `package.module:function`; or a function `track(frames, points, mask, spacing, frame_time, seed, **options)`
        as docs/trackers.md describes it.
    **options
        Settings of the method, or keyword arguments of the function.

    Returns
    -------
    Dataset
        displacement (frame, axial, lateral, plane), m, since end-diastole, and quality (frame, axial, lateral) at the
        points of the trackers' grid; NaN outside the wall. In volumes (frame, point, vector) and (frame, point), at
        points of the wall whose positions are coordinates (docs/volumes.md).

    Raises
    ------
    ConfigError
        If there is no such method or setting.
    TrackerFailed
        If the tracker finds no motion.
    ValueError
        If the clip is not a whole cycle, is cropped or reversed, has infinite pixels, or has lost its
        attributes.

    Examples
    --------
    >>> import echotruth as et
    >>> clip = et.Repository("out/demo").clip(view="mid", size=128)
    >>> tracked = et.track(clip, "dis")
    >>> tracked["displacement"].dims, tracked["displacement"].units
    (('frame', 'axial', 'lateral', 'plane'), 'm')

    A tracker is any function of these six arguments:

    >>> import numpy as np
    >>> def at_rest(frames, points, mask, spacing, frame_time, seed):
    ...     return np.zeros((len(frames), len(points), 2))
    >>> float(np.abs(et.track(clip, at_rest)["displacement"]).max())
    0.0
    """
    check_clip(clip, volumes=True)
    if missing := [name for name in ("image", "mask", *["grid_mask"] * (not is_volume(clip))) if name not in clip]:
        raise ValueError(f"clip: has no {missing[0]}: load it with image and mask among its variables.")
    case = case_of(clip)
    check_whole(clip, case.config)
    if (unknown := clip["image"].isnull().any([dim for dim in clip["image"].dims if dim != "frame"]).values).any():
        frames = f"{unknown.sum()} of {len(unknown)} frames have pixels that are NaN"
        warnings.warn(f"{frames}: no displacement is estimated from these", stacklevel=2)
    if is_volume(clip):
        from echotruth.notebook.volume import track_volume  # compiled; whoever tracks a slice needs none of it

        return track_volume(clip, tracker_section(case.config, tracker, options)).assign_attrs(tracker=_name(tracker))
    inside, size = clip["grid_mask"].values, clip.sizes["axial"]
    points = grid_points(case.config, size)[inside]
    spacing = case.config.bmode.field_of_view_mm * mm / size
    seed = tracker_seed(case, clip.attrs["view"])
    image, mask = (clip[name].transpose("frame", "axial", "lateral").values for name in ("image", "mask"))
    arguments = Clip(
        *(image, mask[0], inside, points, spacing, clip["time"].values, seed, case.config.tracking.frame_step),
        is_closed=case.config.views[clip.attrs["view"]].motion.is_closed,
    )
    settings = tracker_section(case.config, tracker, options)
    found = track_points(*arguments.tracker_arguments, settings)
    for doubt in doubts(image, mask[0], spacing, settings):
        warnings.warn(doubt, stacklevel=2)
    displacement, quality = arguments.on_grid(*found)
    coordinates = {"axial": clip["grid_axial"].values, "lateral": clip["grid_lateral"].values}
    values = {"tracking/TRACKER": {"displacement": displacement, "quality": quality}}
    return dataset(case, as_stored(case, values), coordinates).assign_attrs(clip.attrs, tracker=_name(tracker))


def evaluate(tracked: xr.Dataset, heart: Heart) -> pd.Series:
    """Compare a tracked motion with that of the heart.

    Parameters
    ----------
    tracked : Dataset
        As :func:`track` returns it. One from elsewhere needs `displacement` (frame, axial, lateral, plane), m, since
        end-diastole, the coordinates axial and lateral, m, and the attributes of the clip; in volumes `displacement`
        (frame, point, vector), and the positions of the points.
    heart : Heart
        The heart that was imaged.

    Returns
    -------
    Series
        The metrics of the leaderboard, each with its unit in its name, as `nrmse_percent` (docs/conventions.md); of
        volumes those of docs/volumes.md.

    Raises
    ------
    ValueError
        If it is another heart, frames are missing, or the data set has lost its attributes.

    Examples
    --------
    >>> import echotruth as et
    >>> demo = et.Repository("out/demo")
    >>> heart, clip = demo.heart(), demo.clip(view="mid", size=128)
    >>> scores = et.evaluate(et.track(clip, "dis"), heart)
    >>> bool(scores["nrmse_percent"] < 100)  # it finds more than nothing
    True
    """
    check_clip(tracked, "tracked", volumes=True)
    check_heart(heart)
    if is_volume(tracked):
        from echotruth.notebook.volume import evaluate_volume  # compiled, as in track

        return evaluate_volume(tracked, heart)
    if "displacement" not in tracked or set(tracked["displacement"].dims) != {"frame", "axial", "lateral", "plane"}:
        raise ValueError("tracked: has no displacement (frame, axial, lateral, plane): give what et.track returns.")
    case, attributes, (moving, plane) = case_of(tracked), tracked.attrs, imaged_heart(tracked, heart)
    frames = len(heart.displacement)
    if tracked.sizes["frame"] != frames:
        raise ValueError(f"The displacement has {tracked.sizes['frame']} frames, and the heart has {frames}.")
    kind = case.config.views[attributes["view"]].plane
    lateral, axial = np.meshgrid(tracked["lateral"].values, tracked["axial"].values)
    position = np.stack([lateral, axial], axis=-1)
    truth = truth_at(moving, plane, kind, position, case.config)
    displacement = tracked["displacement"].transpose("frame", "axial", "lateral", "plane").values
    return pd.Series(metrics(score(displacement, truth), kind), name=attributes.get("tracker"))


def _name(tracker: str | Callable[..., Any]) -> str:
    return tracker if isinstance(tracker, str) else getattr(tracker, "__name__", type(tracker).__name__)

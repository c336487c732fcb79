"""From a configuration to a heart, from a heart to a clip, and from a clip to a score."""

import logging
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from threadpoolctl import threadpool_limits

from echotruth.cases import Case
from echotruth.config import Config, Probe, View
from echotruth.config.building import Source, configure, tracker_section
from echotruth.config.diagnosis import bounds_of
from echotruth.evaluation.clip import Clip, tracker_seed
from echotruth.evaluation.scoring import metrics, score, truth_at
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, clip_gain, pixel_centres
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import before_probe
from echotruth.loop.cycle import heart_cycle
from echotruth.mechanics.beat import beat as mechanics_beat
from echotruth.mechanics.beat import simulate
from echotruth.mechanics.bounds import violation
from echotruth.mechanics.physiology import measured_heart
from echotruth.notebook.arguments import check_clip, check_heart, check_whole
from echotruth.repository.choice import image_size
from echotruth.repository.datasets import as_stored, case_of, clip_dataset, dataset, imaged_heart
from echotruth.seeds import generator
from echotruth.tracking.plausibility import doubts
from echotruth.tracking.point_grid import grid_points
from echotruth.tracking.tracker import track as track_points


def beat(config: Source = None, progress: bool = True, *, frames: Iterable[int] | None = None) -> Heart:
    """Move a heart through one cycle: its beat, or a prescribed motion.

    Parameters
    ----------
    config : Config, dict, str or Path, optional
        Anything that :func:`echotruth.configure` accepts.
    progress : bool
        Whether a line on stderr says how far it is, where a person watches.
    frames : sequence of int, optional
        Frames of the cycle that are solved, from 0, end-diastole, on; the others are passed over in larger steps of
        time. :func:`echotruth.systole` names those that give the strain of end-systole in half the time.

    Returns
    -------
    Heart
        Its `arrays` hold the groups geometry, fibres, pathology, mechanics, kinematics and physiology (docs/schema.md);
        `echotruth.heart_dataset` gives them dimensions and units. A heart that violates a bound of the section
        physiology is returned with a warning. With `frames` there is no physiology, which is that of a whole cycle, and
        the heart is not imaged.

    Raises
    ------
    ConfigError
        If the configuration is invalid.
    GeometryError, FibreError, PathologyError, LoopError, MotionError, Diverged
        If geometry, fibres, pathology, loop or motion are invalid, or the solver does not converge.

    Examples
    --------
    >>> import echotruth as et
    >>> coarse = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
    >>> heart = et.beat({"geometry": coarse, "loop": {"frames": 4}})  # a few seconds; without keys, a minute
    >>> round(1e9 * float(heart.arrays["mechanics"]["volume"][0]))  # uL at end-diastole
    50
    """
    settings = configure(config)
    if settings.cases:
        keys = ", ".join(settings.cases.keys)
        raise ValueError(f"cases sweeps {keys}: beat one, as echotruth.expand(config)[0].config")
    with progress_line("beat", progress):
        arrays = simulate(settings) if frames is None else mechanics_beat(settings, list(frames))
    if frames is not None:
        return Heart.of(arrays, settings)
    arrays["physiology"], bounded = measured_heart(arrays, settings)
    if reason := violation(bounded, bounds_of(settings)):
        warnings.warn(f"implausible heart: {reason}", stacklevel=2)
    return Heart.of(arrays, settings)


def systole(config: Source = None) -> list[int]:
    """Frames of a loop from end-diastole to end-systole, for :func:`echotruth.beat`.

    Parameters
    ----------
    config : Config, dict, str or Path, optional
        Anything that :func:`echotruth.configure` accepts.

    Returns
    -------
    list of int
        Without diastole a heart takes about half the time, and its end-systole is that of the whole cycle.

    Examples
    --------
    >>> import echotruth as et
    >>> frames = et.systole()
    >>> frames[0], frames[-1]
    (0, 21)
    """
    return heart_cycle(configure(config)).systole


def image(
    heart: Heart,
    view: str | View = "mid",
    probe: str | Probe | None = None,
    size: int | None = None,
    *,
    keep_lines: bool = False,
    progress: bool = True,
) -> xr.Dataset:
    """Image a heart, frame by frame.

    Parameters
    ----------
    heart : Heart
        Its configuration says how it is imaged.
    view : str or View
        Name of a view of the configuration, or an imaging plane.
    probe : str or Probe, optional
        Another array, or its name; what follows the array by default (scan, density of scatterers) follows it.
    size : int, optional
        Pixels along a side: `bmode.size_px` over one of `bmode.downsampling`. Default: the largest.
    keep_lines : bool
        Whether the demodulated lines are returned as well.
    progress : bool
        Whether a line on stderr says how far it is, where a person watches.

    Returns
    -------
    Dataset
        The clip `image` (frame, axial, lateral), uint8, and the truth at every pixel: displacement since end-diastole
        (m), strain, mask, layer, segment, region, wall_depth, and flow to the previous and to the next frame (m). The
        image shows a slice of tissue of a `thickness` (m); `leaves` and `enters` say which tissue is beside it in the
        next frame, and was in the previous one. Units are attributes of each array. `grid_mask` says which points of
        the trackers' grid are in the wall.

    Raises
    ------
    ConfigError
        If the probe does not suit the configuration.
    ValueError
        If there is no such view or size.

    Examples
    --------
    >>> import echotruth as et
    >>> heart = et.Repository("out/demo").heart()
    >>> clip = et.image(heart, et.View(position=0.4), size=128)  # a plane that the repository does not have
    >>> clip["image"].dims, str(clip["image"].dtype)
    (('frame', 'axial', 'lateral'), 'uint8')
    >>> clip["displacement"].dims, clip["displacement"].units
    (('frame', 'axial', 'lateral', 'vector'), 'm')
    """
    check_heart(heart)
    if heart.config is None:
        raise ValueError("The heart has no configuration: make it by echotruth.beat, or read one of a Repository.")
    config, name = _imaged_by(heart.config, view, probe)
    size = image_size(config, size)
    case, (moving, plane) = Case("heart", {}, config), before_probe(heart, config, name)
    random, is_closed = partial(generator, case, name), config.views[name].motion.is_closed
    sequence = Sequence(config, moving, plane, random)
    with progress_line("image", progress):
        lines, range_ = sequence.lines(sequence.scatterers()), sequence.scanner.range
    gain = clip_gain(config.probe, config.bmode, config.rf.lines, range_, random("dropout"))
    pixels = pixel_centres(config.bmode, size)
    tissue = TissueImages(config, moving, plane, *pixels)
    images = bmode_clip(lines, sequence.scanner.scan, range_, config.bmode, gain, is_closed)
    values = {
        f"bmode/{size}": {"image": images[size]},
        f"truth/{size}": pixel_truth(moving, plane, *pixels, tissue),
    }
    clip = clip_dataset(heart, case, name, plane, as_stored(case, values))
    if keep_lines:
        about = {"long_name": "lines, demodulated by exp(-4 pi i f range / c)", "frequency": sequence.scanner.frequency}
        clip["lines"] = (("frame", "line", "range"), lines, about)
        clip = clip.assign_coords(range=range_, line_angle=("line", sequence.scanner.angle))
    return clip


def track(clip: xr.Dataset, tracker: str | Callable[..., Any] = "bspline_dic", **options: Any) -> xr.Dataset:
    """Track the wall in a clip.

    Parameters
    ----------
    clip : Dataset
        A whole cycle, as :func:`image` or :meth:`echotruth.Repository.clip` returns it. The tracker sees `image`, and
        the wall at end-diastole.
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
        points of the trackers' grid; NaN outside the wall.

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
    check_clip(clip)
    if missing := [name for name in ("image", "mask", "grid_mask") if name not in clip]:
        raise ValueError(f"clip: has no {missing[0]}: load it with image and mask among its variables.")
    case = case_of(clip)
    check_whole(clip, case.config)
    inside, size = clip["grid_mask"].values, clip.sizes["axial"]
    points = grid_points(case.config, size)[inside]
    spacing = case.config.bmode.si().field_of_view / size
    seed = tracker_seed(case, clip.attrs["view"])
    image, mask = (clip[name].transpose("frame", "axial", "lateral").values for name in ("image", "mask"))
    if (unknown := np.isnan(image).any(axis=(1, 2))).any():
        frames = f"{unknown.sum()} of {len(image)} frames have pixels that are NaN"
        warnings.warn(f"{frames}: no displacement is estimated from these", stacklevel=2)
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
    values = {"tracking/SIZE": {"displacement": displacement, "quality": quality}}
    return dataset(case, as_stored(case, values), coordinates).assign_attrs(clip.attrs, tracker=_name(tracker))


def evaluate(tracked: xr.Dataset, heart: Heart) -> pd.Series:
    """Compare a tracked motion with that of the heart.

    Parameters
    ----------
    tracked : Dataset
        As :func:`track` returns it. One from elsewhere needs `displacement` (frame, axial, lateral, plane), m, since
        end-diastole, the coordinates axial and lateral, m, and the attributes of the clip.
    heart : Heart
        The heart that was imaged.

    Returns
    -------
    Series
        The metrics of the leaderboard, each with its unit in its name, as `nrmse_percent` (docs/conventions.md).

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
    check_clip(tracked, "tracked")
    check_heart(heart)
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


def _imaged_by(config: Config, view: str | View, probe: str | Probe | None) -> tuple[Config, str]:
    """Configuration with the view and the probe asked for, and the name of the view."""
    if isinstance(probe, str):
        config = configure(config, probe={"preset": probe})
    elif probe is not None:
        config = configure(config, probe=probe.model_dump())
    if isinstance(view, View):
        return config.model_copy(update={"views": {"view": view}}), "view"
    if view not in config.views:
        raise ValueError(f"view = {view!r}: use one of {', '.join(config.views)}, or give a View.")
    return config, view


def _name(tracker: str | Callable[..., Any]) -> str:
    return tracker if isinstance(tracker, str) else getattr(tracker, "__name__", type(tracker).__name__)


@contextmanager
def progress_line(what: str, progress: bool) -> Iterator[None]:
    """Show what the package logs on one line of stderr, where a person watches; BLAS runs on one thread.

    Its sums depend on the number of threads, and the bytes must not.
    """
    logger, handler = logging.getLogger("echotruth"), logging.StreamHandler(sys.stderr)
    watched = progress and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    handler.terminator = ""
    handler.setFormatter(logging.Formatter(f"\r\033[K{what}: %(message)s"))
    level = logger.level
    if watched:
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
    try:
        with threadpool_limits(1):
            yield
    finally:
        if watched:
            logger.removeHandler(handler)
            logger.setLevel(level)
            sys.stderr.write("\r\033[K")

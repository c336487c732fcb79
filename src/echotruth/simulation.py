"""From a configuration to a heart, from a heart to a clip, from a clip to a score: what a notebook calls.

These functions do in memory what the workflow does in a repository, by the same functions and with the same bytes.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echotruth.cases import Case
from echotruth.config import Config, Probe, View
from echotruth.config.loading import read_yaml, validate
from echotruth.config.tracking import External
from echotruth.evaluation.clip import Clip
from echotruth.evaluation.scoring import metrics, score, truth_at
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, pixel_centres, time_gain_compensation
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import Plane, imaging_plane
from echotruth.loop.cycle import read_loop
from echotruth.mechanics.beat import simulate
from echotruth.repository import schema
from echotruth.seeds import generator
from echotruth.tracking.tracker import track as track_points
from echotruth.tracking.windows import grid

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def configure(source: Config | dict[str, Any] | str | Path | None = None, **sections: Any) -> Config:
    """Make a configuration from a file, a mapping or nothing, with some keys replaced.

    Parameters
    ----------
    source : Config, dict, str or Path, optional
        A configuration, its keys and values, or a YAML file. Default: the default heart. What the presets of a Config
        have decided (the loop of a species, the scan of an array) stays as it is.
    **sections
        Sections and their keys, as `geometry={"preset": "human"}` (config/README.md).

    Returns
    -------
    Config

    Raises
    ------
    ConfigError
        With one sentence that names key, value and remedy.

    Examples
    --------
    >>> configure(geometry={"preset": "rat"}).probe.preset
    'rat_15MHz'
    """
    if isinstance(source, str | Path):
        values, name = read_yaml(Path(source)), str(source)
    else:
        values, name = source.model_dump() if isinstance(source, Config) else source or {}, "configuration"
    for key, given in sections.items():
        merged = isinstance(given, dict) and isinstance(values.get(key), dict) and key not in ("views", "cases")
        values = values | {key: values[key] | given if merged else given}
    return validate(values, name)


def beat(config: Config | dict[str, Any] | str | Path | None = None, scratch: Path | None = None) -> Heart:
    """Solve one cycle of a heart.

    Parameters
    ----------
    config : Config, dict, str or Path, optional
        As of :func:`configure`.
    scratch : Path, optional
        Folder in which solved frames are kept, so that a stopped run goes on there.

    Returns
    -------
    Heart
        Its `arrays` hold all that a repository keeps of it: `heart.arrays["mechanics"]["pressure"]` (docs/schema.md).

    Raises
    ------
    GeometryError, FibreError, PathologyError, LoopError, MotionError, Diverged
        With one sentence, if there is no such heart, no such loop or no equilibrium.
    """
    settings = config if isinstance(config, Config) else configure(config)
    return Heart.of(simulate(settings, scratch), settings)


def image(
    heart: Heart, view: str | View = "mid", probe: str | Probe | None = None, size: int | None = None
) -> xr.Dataset:
    """Image a heart, frame by frame.

    Parameters
    ----------
    heart : Heart
        As :func:`beat` returns it; its configuration says how it is imaged.
    view : str or View
        Name of a view of the configuration, or an imaging plane.
    probe : str or Probe, optional
        Name of an array, or the array, in place of that of the configuration.
    size : int, optional
        Pixels along a side, one of `bmode.sizes`. Default: the largest.

    Returns
    -------
    Dataset
        The clip `image` (frame, axial, lateral), uint8, and the truth at every pixel: displacement since end-diastole
        (m), strain, mask, layer, segment, region and wall_depth; units are attributes of each array.

    Raises
    ------
    ValueError
        If there is no such view or size.
    """
    if heart.config is None:
        raise ValueError("The heart has no configuration: make it by echotruth.beat.")
    config, name = _imaged_by(heart.config, view, probe)
    size = size or config.bmode.sizes[0]
    if size not in config.bmode.sizes:
        raise ValueError(f"size = {size}: use one of {', '.join(map(str, config.bmode.sizes))}, or change bmode.")
    where = imaging_plane(config.views[name], config.rf, heart.positions(0)[heart.endo.ravel()])
    sequence = Sequence(config, heart, where, partial(generator, Case("heart", {}, config), name))
    lines, range_ = sequence.lines(sequence.scatterers()), sequence.scanner.range
    gain = time_gain_compensation(config.probe, config.bmode, range_)
    axial, lateral = pixel_centres(config.bmode, size)
    values = {
        f"bmode/{size}": {"image": bmode_clip(lines, sequence.scanner.scan, range_, config.bmode, gain)[size]},
        f"truth/{size}": pixel_truth(heart, where, axial, lateral),
    }
    coordinates = {"axial": axial, "lateral": lateral}
    attributes = {"view": name, "plane_origin": where.origin.tolist(), "plane_axes": where.axes.ravel().tolist()}
    return _dataset(config, values, coordinates).assign_attrs(attributes, config=config.model_dump_json())


def track(clip: xr.Dataset, tracker: str | Callable[..., Any] = "bspline_dic", **options: Any) -> xr.Dataset:
    """Track the wall in a clip.

    Parameters
    ----------
    clip : Dataset
        As :func:`image` returns it; the tracker sees `image` and the wall at end-diastole.
    tracker : str or callable
        Name of a method (config/README.md, `tracking.trackers`), or a function
        `track(frames, points, mask, spacing, frame_time, seed, **options)` as docs/trackers.md describes it.
    **options
        Settings of the method, or keyword arguments of the function.

    Returns
    -------
    Dataset
        displacement (frame, axial, lateral, plane), m, since end-diastole, and quality (frame, axial, lateral) at every
        `tracking.grid_px`-th pixel; NaN outside the wall.

    Raises
    ------
    ConfigError
        If there is no such method or setting.
    TrackerFailed
        If the tracker finds no motion.
    """
    config, given = _config_of(clip), {"method": tracker, **options}
    if callable(tracker):
        settings: Any = External.model_construct(track=tracker, options=options)
    else:
        settings = configure(config, tracking={"trackers": {"tracker": given}}).tracking.trackers["tracker"]
    points = _grid(clip, config.tracking.grid_px)
    mask = clip["mask"].values[0]
    inside = mask[points[..., 1], points[..., 0]]
    seed = int(generator(Case("heart", {}, config), clip.attrs["view"], "tracking").integers(2**31))
    spacing = config.bmode.si().field_of_view / clip.sizes["axial"]
    arguments = Clip(
        clip["image"].values, mask, inside, points[inside].astype(float), spacing, clip["time"].values, seed
    )
    displacement, quality = arguments.on_grid(*track_points(*arguments.tracker_arguments, settings))
    group = f"tracking/{config.bmode.sizes[0]}"
    coordinates = {
        "axial": clip["axial"].values[points[:, 0, 1]],
        "lateral": clip["lateral"].values[points[0, :, 0]],
    }
    values = {group: {"displacement": displacement, "quality": quality}}
    named = {"tracker": getattr(tracker, "__name__", tracker)}
    return _dataset(config, values, coordinates).assign_attrs(clip.attrs, **named)


def evaluate(tracked: xr.Dataset, heart: Heart) -> pd.Series:
    """Compare a tracked motion with that of the heart.

    Parameters
    ----------
    tracked : Dataset
        As :func:`track` returns it; `displacement` may come from elsewhere.
    heart : Heart
        The heart that was imaged.

    Returns
    -------
    Series
        The metrics of the leaderboard, each with its unit in its name, as `nrmse_percent` (docs/tracking.md).
    """
    import pandas as pd

    config, attributes = _config_of(tracked), tracked.attrs
    kind = config.views[attributes["view"]].plane
    where = Plane(np.array(attributes["plane_origin"]), np.reshape(attributes["plane_axes"], (3, 3)))
    lateral, axial = np.meshgrid(tracked["lateral"].values, tracked["axial"].values)
    truth = truth_at(heart, where, kind, np.stack([lateral, axial], axis=-1), config.bmode.si().field_of_view)
    displacement = tracked["displacement"].transpose("frame", "axial", "lateral", "plane").values
    return pd.Series(metrics(score(displacement, truth), kind), name=attributes.get("tracker"))


def open(repository: str | Path) -> xr.DataTree:
    """Open a repository.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`.

    Returns
    -------
    DataTree
        One group a stage (docs/schema.md), read when used; `tree["cases"].to_dataset().to_dataframe()` is the table of
        cases.

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    import xarray as xr

    folder = Path(repository)
    store = folder if folder.suffix == ".zarr" else folder / f"{folder.resolve().name}.zarr"
    if not store.is_dir():
        raise FileNotFoundError(f"{store}: is not a repository: give the folder that a run made, as out/demo")
    return xr.open_datatree(store, engine="zarr")


def _config_of(clip: xr.Dataset) -> Config:
    if "config" not in clip.attrs:
        raise ValueError("The data set has no attribute config: make it by echotruth.image, or keep its attributes.")
    return configure(json.loads(clip.attrs["config"]))


def _grid(clip: xr.Dataset, step: int) -> np.ndarray:
    """Every `step`-th pixel: lateral, axial, px, of shape (grid rows, grid columns, 2)."""
    return grid((clip.sizes["axial"], clip.sizes["lateral"]), step).astype(int)


def _imaged_by(config: Config, view: str | View, probe: str | Probe | None) -> tuple[Config, str]:
    """Configuration with the view and the probe asked for, and the name of the view."""
    if probe is not None:
        config = configure(config, probe={"preset": probe} if isinstance(probe, str) else probe)
    if isinstance(view, View):
        return config.model_copy(update={"views": {"view": view}}), "view"
    if view not in config.views:
        raise ValueError(f"view = {view!r}: use one of {', '.join(config.views)}, or give a View.")
    return config, view


def _dataset(config: Config, groups: dict[str, dict[str, Any]], coordinates: dict[str, np.ndarray]) -> xr.Dataset:
    """Arrays of one view with the dimensions, units and meanings of the repository."""
    import xarray as xr

    found = {}
    for group, values in groups.items():
        for array in schema.groups(config)[group]:
            if array.name in values:
                about = {"units": array.units, "long_name": array.long_name}
                dims = [dim for dim in array.dims if dim not in ("case", "view", "tracker")]
                found[array.name] = (dims, np.asarray(values[array.name], array.dtype), about)
    data = xr.Dataset(found)
    labels = schema.LABELS | coordinates
    data = data.assign_coords({name: (name, np.asarray(labels[name])) for name in data.dims if name in labels})
    return data.assign_coords(time=("frame", read_loop(config.loop).time, {"units": "s"}))

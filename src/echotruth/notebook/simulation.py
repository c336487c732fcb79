"""From a configuration to a heart, and from a heart to a clip."""

import logging
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial

import xarray as xr
from threadpoolctl import threadpool_limits

from echotruth.cases import Case
from echotruth.config import Config, Probe, View
from echotruth.config.building import Source, configure
from echotruth.config.diagnosis import bounds_of
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, clip_gain, pixel_centres, time_gain_compensation, volume_images
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import pixel_truth, wall_mask
from echotruth.imaging.view import before_probe
from echotruth.imaging.volume_sequence import VolumeSequence
from echotruth.loop.cycle import heart_cycle
from echotruth.mechanics.beat import beat as mechanics_beat
from echotruth.mechanics.beat import simulate
from echotruth.mechanics.bounds import violation
from echotruth.mechanics.physiology import measured_heart
from echotruth.notebook.arguments import check_heart
from echotruth.repository.choice import image_size
from echotruth.repository.datasets import as_stored, clip_dataset, source_of, volume_dataset
from echotruth.seeds import generator
from echotruth.tracking.point_grid import grid_positions


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
        Pixels along a side: `bmode.size_px` over one of `bmode.downsampling`. Default: the largest. Not of a volume.
    keep_lines : bool
        Whether the demodulated lines are returned as well; not of a volume.
    progress : bool
        Whether a line on stderr says how far it is, where a person watches.

    Returns
    -------
    Dataset
        The clip `image` (frame, axial, lateral), uint8, and the truth at every pixel: displacement since end-diastole
        (m), strain, mask, layer, segment, region, wall_depth, and flow to the previous and to the next frame (m). The
        image shows a slice of tissue of a `thickness` (m); `leaves` and `enters` say which tissue is beside it in the
        next frame, and was in the previous one. Units are attributes of each array. `grid_mask` says which points of
        the trackers' grid are in the wall. Of a view whose plane is `volume`: `image` (frame, axial, elevation,
        lateral), uint8, and `mask`, the wall at end-diastole; :func:`echotruth.voxel_truth` has the rest.

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
    if config.views[name].plane == "volume" and (size is not None or keep_lines):
        raise ValueError("size, keep_lines: are of slices: volume.size of the configuration sets the voxels.")
    size = image_size(config, size)
    case, (moving, plane) = Case("heart", {}, config), before_probe(heart, config, name)
    random, is_closed = partial(generator, case, name), config.views[name].motion.is_closed
    if plane.is_volume:
        volumes = VolumeSequence(config, moving, plane, random)
        with progress_line("image", progress):
            found = volumes.volumes(volumes.scatterers())
        gain = time_gain_compensation(config.probe, config.bmode, volumes.scanner.axial)
        volume = volume_images(found["volumes"], found["volumes_step"], gain, config.bmode, is_closed)
        return volume_dataset(case, name, volume, volumes.wall, source_of(heart, plane))
    sequence = Sequence(config, moving, plane, random)
    with progress_line("image", progress):
        lines, range_ = sequence.lines(sequence.scatterers()), sequence.scanner.range
    gain = clip_gain(config.probe, config.bmode, lines.shape[:2], range_, random("dropout"))
    pixels = pixel_centres(config.bmode, size)
    tissue = TissueImages(config, moving, plane, *pixels)
    images = bmode_clip(lines, sequence.scanner.scan, range_, config.bmode, gain, is_closed)
    values = {
        f"bmode/{size}": {"image": images[size]},
        f"truth/{size}": pixel_truth(moving, plane, *pixels, tissue),
    }
    points = grid_positions(config)
    inside = wall_mask(heart, plane, points[:, 0, 1], points[0, :, 0])
    clip = clip_dataset(case, name, as_stored(case, values), inside, source_of(heart, plane))
    if keep_lines:
        about = {"long_name": "lines, demodulated by exp(-4 pi i f range / c)", "frequency": sequence.scanner.frequency}
        clip["lines"] = (("frame", "line", "range"), lines, about)
        clip = clip.assign_coords(range=range_, line_angle=("line", sequence.scanner.angle))
    return clip


def _imaged_by(config: Config, view: str | View, probe: str | Probe | None) -> tuple[Config, str]:
    """Configuration with the view and the probe asked for, and the name of the view."""
    if isinstance(probe, str):
        config = configure(config, probe={"preset": probe})
    elif probe is not None:
        config = configure(config, probe=probe.model_dump())
    if isinstance(view, View):
        return configure(config, views={"view": view.model_dump()}), "view"
    if view not in config.views:
        raise ValueError(f"view = {view!r}: use one of {', '.join(config.views)}, or give a View.")
    return config, view


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

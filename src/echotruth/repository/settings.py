"""Settings on which the results of stages depend: if these and the code are the same, so are the bytes."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from echotruth.config import Config, Geometry, Loop
from echotruth.loop.cycle import frame_times, recorded_curves
from echotruth.repository.provenance import settings_version

Settings = tuple[Any, ...]


def mechanics(config: Config) -> str:
    """Hash of what the motion of a heart depends on; hearts with the same one have the same motion."""
    content = [_mesh_hash(config.geometry)]
    if config.motion.kind == "beat":
        content.append(settings_version(_curves(config.loop)))
    if config.motion.kind == "file":
        content.append(_series_hash(str(config.motion.file.path)))
    return settings_version(*_motion(config), *content)


def _motion(config: Config) -> Settings:
    """What the motion of a heart depends on, besides the content of the files that it names."""
    # Only fibre disarray depends on the seed.
    seed = config.seed if config.fibres.disarray_deg else None
    anatomy = (config.geometry.resolved(), config.fibres, seed, config.pathology)
    if config.motion.kind == "beat":
        return (*anatomy, config.loop, config.mechanics)
    formula = getattr(config.motion, config.motion.kind)
    return (*anatomy, _times(config.loop), config.motion.time_course, formula, config.rf.focus_mm)


def phantom(config: Config, view: str) -> Settings:
    """What the scatterers of a view depend on, and their echoes."""
    depth = config.bmode.field_of_view_mm
    levels = config.realism.model_dump(mode="json", exclude={"preset"})
    return config.seed, config.views[view], config.phantom, config.probe.resolved(), config.rf, levels, depth


def truth(config: Config, view: str) -> Settings:
    """What the truth of a view depends on."""
    settings = config.views[view], config.rf.focus_mm, config.bmode.field_of_view_mm, config.bmode.size_px
    return *settings, *_neighbours(config)


def _neighbours(config: Config) -> Settings:
    """What the labels of the neighbours depend on, besides the heart and the view."""
    present = [level is not None for level in config.realism.neighbours.model_dump().values()]
    if not any(present):
        return (present,)
    surroundings = config.realism.surroundings
    return present, surroundings.start_mm, surroundings.motion_decay_mm, config.probe.resolved(), config.rf


def bmode(config: Config, view: str) -> Settings:
    """What the images of a view depend on."""
    image = config.bmode.model_copy(update={"downsampling": (1,)})
    return image, config.probe.resolved(), config.rf


def tracking(config: Config, view: str) -> Settings:
    """What trackers find in a view."""
    return config.seed, config.tracking


def inference(config: Config) -> Settings:
    """What is inferred from what a tracker saw of a heart depends on, besides the heart and the content of a table."""
    return (config.inference,)


OF_VIEW: dict[str, Callable[[Config, str], Settings]] = {
    "phantom": phantom,
    "rf": phantom,
    "truth": truth,
    "bmode": bmode,
    "tracking": tracking,
}
"""Stages of a view -> their settings, besides what the stages before them depend on."""


_BEFORE = {"phantom": (), "rf": (), "truth": (), "bmode": ("phantom",), "tracking": ("phantom", "truth", "bmode")}
"""Stages of a view -> those before it, besides mechanics, whose settings it does not share."""


def of_job(config: Config, stage: str, view: str | None) -> str:
    """Hash of all settings on which the result of a job depends, those of the stages before it included.

    It does not depend on the content of the files that a configuration names, which need not be there any more.

    Parameters
    ----------
    config : Config
        Of the case.
    stage : str
    view : str or None
        None for the stages of a heart: mechanics, and inference, which depends on all views.

    Raises
    ------
    LoopError
        If a motion has the times of a loop that cannot be read.
    """
    if stage == "inference":
        views, stages, own = list(config.views), list(OF_VIEW), inference(config)
    else:
        views, stages, own = [] if view is None else [view], [*_BEFORE.get(stage, ()), stage], ()
    of_views = [settings_version(*OF_VIEW[each](config, name)) for name in views for each in stages]
    return settings_version(*_motion(config), *of_views, *own)


@lru_cache(maxsize=1000)
def _curves(loop: Loop) -> dict[str, Any]:
    """Curves that are prescribed, read once for all hearts that share them."""
    return {name: None if values is None else values.tolist() for name, values in recorded_curves(loop).items()}


@lru_cache(maxsize=1000)
def _times(loop: Loop) -> list[float]:
    """Times of the frames, s."""
    return frame_times(loop).tolist()


def _mesh_hash(geometry: Geometry) -> str:
    """Hash of the mesh file, or an empty string; modules that read meshes, and compile, are loaded only for one."""
    if geometry.file is None:
        return ""
    from echotruth.mechanics.geometry.imported_mesh import fingerprint

    return fingerprint(geometry)


def _series_hash(path: str) -> str:
    """Hash of all files of a series."""
    from echotruth.mechanics.motion_file.files import content_hash

    return content_hash(path)


def motions(configs: dict[str, Config]) -> dict[str, str]:
    """Hash of what the motion of each heart depends on, made once for hearts that share their sections.

    Parameters
    ----------
    configs : dict
        Case -> configuration.
    """
    known: dict[tuple[Any, ...], str] = {}
    hashes: dict[str, str] = {}
    for case, config in configs.items():
        sections = (config.geometry, config.fibres, config.pathology, config.loop, config.mechanics, config.motion)
        seed = config.seed if config.fibres.disarray_deg else None
        shared = (*map(id, sections), seed, config.rf.focus_mm)
        if shared not in known:
            known[shared] = mechanics(config)
        hashes[case] = known[shared]
    return hashes

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
    # Only fibre disarray depends on the seed.
    seed = config.seed if config.fibres.disarray_deg else None
    anatomy = (config.geometry.resolved(), _mesh_hash(config.geometry), config.fibres, seed, config.pathology)
    if config.motion.kind == "beat":
        return settings_version(*anatomy, config.loop, _curves(config.loop), config.mechanics)
    formula = getattr(config.motion, config.motion.kind)
    if config.motion.kind == "file":
        formula = settings_version(formula, _series_hash(str(config.motion.file.path)))
    amplitude = (_times(config.loop), config.motion.time_course)
    return settings_version(*anatomy, *amplitude, formula, config.rf.focus_mm)


def phantom(config: Config, view: str) -> Settings:
    """What the scatterers of a view depend on, and their echoes."""
    depth = config.bmode.field_of_view_mm
    return config.seed, config.views[view], config.phantom, config.probe.resolved(), config.rf, config.realism, depth


def truth(config: Config, view: str) -> Settings:
    """What the truth of a view depends on."""
    return config.views[view], config.rf.focus_mm, config.bmode.field_of_view_mm, config.bmode.size_px


def bmode(config: Config, view: str) -> Settings:
    """What the images of a view depend on."""
    image = config.bmode.model_copy(update={"downsampling": (1,)})
    return image, config.probe.resolved(), config.rf


def tracking(config: Config, view: str) -> Settings:
    """What trackers find in a view."""
    return config.seed, config.tracking


OF_VIEW: dict[str, Callable[[Config, str], Settings]] = {
    "phantom": phantom,
    "rf": phantom,
    "truth": truth,
    "bmode": bmode,
    "tracking": tracking,
}
"""Stages of a view -> their settings, besides what the stages before them depend on."""


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

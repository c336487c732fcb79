"""Settings on which the results of stages depend: if these and the code are the same, so are the bytes."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from echotruth.config import Config, Geometry, Loop
from echotruth.loop.cycle import frame_times, recorded_curves
from echotruth.repository.provenance import settings_version

APART = ("name", "cases", "views", "tracking", "physiology")
"""Keys of a configuration that no image depends on, and `views`, of which an image depends on its own."""

LINES = ("phantom", "rf")
"""Stages up to the lines; of the section bmode they depend on the depth alone."""


@lru_cache(maxsize=1000)
def _curves(loop: Loop) -> dict[str, Any]:
    """Curves that are prescribed, read once for all hearts that share them."""
    return {name: None if values is None else values.tolist() for name, values in recorded_curves(loop).items()}


@lru_cache(maxsize=1000)
def _times(loop: Loop) -> list[float]:
    """Times of the frames, s."""
    return frame_times(loop).tolist()


def mechanics_settings(config: Config) -> str:
    """Hash of what the motion of a heart depends on; hearts with the same one have the same motion.

    Parameters
    ----------
    config : Config
        Configuration of one case.
    """
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
            known[shared] = mechanics_settings(config)
        hashes[case] = known[shared]
    return hashes


def imaging_settings(config: Config, view: str) -> str:
    """Hash of what the images of a view depend on, besides the motion of the heart.

    Parameters
    ----------
    config : Config
        Configuration of one case.
    view : str
        Name of the view.
    """
    stages = (config.phantom, config.probe.resolved(), config.rf, config.realism, config.bmode)
    return settings_version(config.seed, config.views[view], *stages)


def stage_settings(stage: str, config: Config, view: str, motion: dict[str, str]) -> str:
    """Hash of all that one stage of the images of a view depends on, besides its code and the id of the case.

    Parameters
    ----------
    stage : str
    config : Config
        Configuration of one case.
    view : str
        Name of the view.
    motion : dict
        Checksums of the shards of the heart, as its record of mechanics has them.
    """
    sections = {name: _values(getattr(config, name)) for name in type(config).model_fields if name not in APART}
    if stage in LINES:
        sections["bmode"] = config.bmode.field_of_view_mm
    return settings_version(sections, config.views[view], _times(config.loop), motion)


def _values(setting: Any) -> Any:
    """A setting as plain values; of a section those that its presets stand for."""
    return setting.resolved().model_dump(mode="json") if hasattr(setting, "resolved") else setting

"""Minimal version of a configuration, to compile its functions.

Its jobs call the same functions with the same types as those of the configuration itself, but take only seconds.
"""

from __future__ import annotations

from echotruth.config import Bmode, Config, Geometry, Motion, Pathology

FRAMES = 3
"""Smallest number of frames for which a frame lies between two others."""
LINES = 16
DENSITY_DIVISOR = 100
"""Density of scatterers in the configuration over that in the miniature."""
MAX_SIZE_PX = 128
"""Largest image size, unless the windows of the trackers need a larger one."""


def miniature(config: Config) -> Config:
    """Configuration with one coarse heart, a prescribed motion, one view and one image size.

    Parameters
    ----------
    config : Config
        Configuration of one case.

    Returns
    -------
    Config
        Array, transmits, realism and trackers are those of `config`.
    """
    density = config.phantom.density_per_mm3 / DENSITY_DIVISOR
    return config.model_copy(
        update={
            "name": "miniature",
            "geometry": _geometry(config),
            "fibres": config.fibres.model_copy(update={"source": "rule", "disarray_deg": 0.0}),
            "pathology": Pathology(),
            "loop": config.loop.model_copy(update={"frames": FRAMES}),
            "motion": Motion(kind="rigid") if config.motion.kind in ("beat", "file") else config.motion,
            "views": dict(list(config.views.items())[:1]),
            "phantom": config.phantom.model_copy(update={"density_per_mm3": density}),
            "rf": config.rf.model_copy(update={"lines": LINES}),
            "bmode": _bmode(config),
        }
    )


def _geometry(config: Config) -> Geometry:
    """Heart in the coarsest mesh; instead of one from a file, the preset of the array's species."""
    species = config.probe.preset.partition("_")[0]
    geometry = Geometry.model_validate({"preset": species}) if config.geometry.file else config.geometry
    elements = ("circumferential_elements", "longitudinal_elements", "transmural_elements")
    return geometry.model_copy(update=dict(zip(elements, (12, 6, 1), strict=True)) | {"given_state": "unloaded"})


def _bmode(config: Config) -> Bmode:
    windows = [getattr(tracker, "window_px", None) or 0 for tracker in config.tracking.trackers.values()]
    size = max(min(MAX_SIZE_PX, config.bmode.sizes[0]), 2 * max(windows))
    return config.bmode.model_copy(update={"size_px": size, "downsampling": (1,)})

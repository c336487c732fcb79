"""A miniature of a configuration: hearts, images and trackers of the same kinds, and next to no size.

Its jobs call the same functions on arrays of the same types as those of the configuration itself, in seconds.
"""

from __future__ import annotations

from echotruth.config import Bmode, Config, Geometry, Motion, Pathology

FRAMES = 3
"""The fewest of which a cycle has a frame between two others."""
LINES = 16
THINNED = 100
"""Scatterers of the configuration to one of the miniature."""
SIDE = 128
"""Most pixels along a side of the image, if the windows of all trackers fit into it."""


def miniature(config: Config) -> Config:
    """A configuration of one small heart that moves by a formula.

    Parameters
    ----------
    config : Config
        Of one case.

    Returns
    -------
    Config
        One view and one image size; array, transmits, realism and trackers are as they were.
    """
    return config.model_copy(
        update={
            "name": "miniature",
            "geometry": _geometry(config),
            "fibres": config.fibres.model_copy(update={"source": "rule", "disarray_deg": 0.0}),
            "pathology": Pathology(),
            "loop": config.loop.model_copy(update={"frames": FRAMES}),
            "motion": Motion(kind="rigid") if config.motion.kind == "beat" else config.motion,
            "views": dict(list(config.views.items())[:1]),
            "phantom": config.phantom.model_copy(update={"density_per_mm3": config.phantom.density_per_mm3 / THINNED}),
            "rf": config.rf.model_copy(update={"lines": LINES}),
            "bmode": _bmode(config),
        }
    )


def _geometry(config: Config) -> Geometry:
    """The heart in the coarsest mesh; one of the size of the array where it was read from a file."""
    species = config.probe.preset.partition("_")[0]
    geometry = Geometry(preset=species) if config.geometry.file else config.geometry
    elements = ("circumferential_elements", "longitudinal_elements", "transmural_elements")
    return geometry.model_copy(update=dict(zip(elements, (12, 6, 1), strict=True)) | {"state": "unloaded"})


def _bmode(config: Config) -> Bmode:
    windows = [getattr(tracker, "window_px", None) or 0 for tracker in config.tracking.trackers.values()]
    side = max(min(SIDE, config.bmode.sizes[0]), 2 * max(windows))
    return config.bmode.model_copy(update={"size_px": side, "downsampling": (1,)})

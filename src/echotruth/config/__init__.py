"""Configuration: models, reading of files, generated reference."""

from echotruth.config.sections import (
    Bmode,
    Config,
    Fibres,
    Geometry,
    Loop,
    Material,
    Mechanics,
    Phantom,
    Probe,
    Rf,
    Section,
    Tracker,
    Tracking,
    View,
)

__all__ = [
    "Bmode",
    "Config",
    "Fibres",
    "Geometry",
    "Loop",
    "Material",
    "Mechanics",
    "Phantom",
    "Probe",
    "Rf",
    "Section",
    "Tracker",
    "Tracking",
    "View",
]

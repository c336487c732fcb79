"""Configuration: models, reading of files, generated reference."""

from echotruth.config.cases import Cases
from echotruth.config.fibres import Fibres
from echotruth.config.geometry import Geometry
from echotruth.config.imaging import Bmode, Phantom, Rf, View
from echotruth.config.inference import Inference
from echotruth.config.loop import Loop
from echotruth.config.mechanics import Active, Mechanics
from echotruth.config.motion import Motion
from echotruth.config.pathology import Pathology
from echotruth.config.physiology import Physiology
from echotruth.config.probe import Probe
from echotruth.config.sections import Config
from echotruth.config.tracking import PhaseCorrelation, Tracking
from echotruth.section import Section

__all__ = [
    "Active",
    "Bmode",
    "Cases",
    "Config",
    "Fibres",
    "Geometry",
    "Inference",
    "Loop",
    "Mechanics",
    "Motion",
    "Pathology",
    "Phantom",
    "PhaseCorrelation",
    "Physiology",
    "Probe",
    "Rf",
    "Section",
    "Tracking",
    "View",
]

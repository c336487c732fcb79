"""Configuration: models, reading of files, generated reference."""

from echotruth.config.cases import Cases as Cases
from echotruth.config.fibres import Fibres as Fibres
from echotruth.config.geometry import Geometry as Geometry
from echotruth.config.imaging import Bmode as Bmode
from echotruth.config.imaging import Phantom as Phantom
from echotruth.config.imaging import Rf as Rf
from echotruth.config.imaging import View as View
from echotruth.config.inference import Inference as Inference
from echotruth.config.loop import Loop as Loop
from echotruth.config.mechanics import Active as Active
from echotruth.config.mechanics import Mechanics as Mechanics
from echotruth.config.motion import Motion as Motion
from echotruth.config.pathology import Pathology as Pathology
from echotruth.config.physiology import Physiology as Physiology
from echotruth.config.probe import Probe as Probe
from echotruth.config.sections import Config as Config
from echotruth.config.tracking import PhaseCorrelation as PhaseCorrelation
from echotruth.config.tracking import Tracking as Tracking
from echotruth.section import Section as Section

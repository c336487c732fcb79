# Public names and where they come from, as lazy_loader and editors read them.
from . import learning
from .cases import expand
from .config import Config, Probe, Rf, View
from .config.building import configure
from .config.loading import ConfigError
from .echo.clip import read_clip
from .echo.failure import EchoError
from .echo.strain import speckle_tracking
from .echo.wall import Wall, read_wall
from .evaluation.curves import strain_peaks
from .heart import Heart
from .imaging.beamforming.scanner import Scanner
from .imaging.rf.full_matrix import FullMatrix
from .imaging.rf.row_column import RowColumn
from .inference.estimate import infer
from .inference.observation import observe
from .notebook.datasets import heart_dataset
from .notebook.kinematics import kinematics
from .notebook.point_tracks import point_tracks
from .notebook.sensitivities import sensitivities
from .notebook.simulation import beat, image, systole
from .notebook.tracking import evaluate, track
from .notebook.velocity import velocity
from .notebook.volume import voxel_truth
from .repository.reader import Repository, sample
from .sharing.fetching import fetch
from .tracking.failure import TrackerFailed

__version__: str

__all__ = [
    "Config",
    "ConfigError",
    "EchoError",
    "FullMatrix",
    "Heart",
    "Probe",
    "Repository",
    "Rf",
    "RowColumn",
    "Scanner",
    "TrackerFailed",
    "View",
    "Wall",
    "beat",
    "configure",
    "evaluate",
    "expand",
    "fetch",
    "heart_dataset",
    "image",
    "infer",
    "kinematics",
    "learning",
    "observe",
    "point_tracks",
    "read_clip",
    "read_wall",
    "sample",
    "sensitivities",
    "speckle_tracking",
    "strain_peaks",
    "systole",
    "track",
    "velocity",
    "voxel_truth",
]

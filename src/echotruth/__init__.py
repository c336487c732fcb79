"""Synthetic echocardiograms of which the true motion is known everywhere.

>>> import echotruth as et
>>> heart = et.beat(et.configure(geometry={"preset": "mouse"}))  # doctest: +SKIP
>>> clip = et.image(heart, "mid")  # doctest: +SKIP
>>> tracked = et.track(clip, "bspline_dic")  # doctest: +SKIP
>>> et.evaluate(tracked, heart)["nrmse_percent"]  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echotruth import learning
    from echotruth.cases import expand
    from echotruth.config import Config, Probe, Rf, View
    from echotruth.config.building import configure
    from echotruth.config.loading import ConfigError
    from echotruth.evaluation.curves import strain_peaks
    from echotruth.heart import Heart
    from echotruth.imaging.beamforming.scanner import Scanner
    from echotruth.imaging.rf.full_matrix import FullMatrix
    from echotruth.notebook.datasets import heart_dataset
    from echotruth.notebook.kinematics import kinematics
    from echotruth.notebook.point_tracks import point_tracks
    from echotruth.notebook.simulation import beat, evaluate, image, track
    from echotruth.repository.reader import Repository
    from echotruth.repository.unpacking import unpack
    from echotruth.tracking.failure import TrackerFailed

__version__ = "0.1.1"

__all__ = [
    "Config",
    "ConfigError",
    "FullMatrix",
    "Heart",
    "Probe",
    "Repository",
    "Rf",
    "Scanner",
    "TrackerFailed",
    "View",
    "beat",
    "configure",
    "evaluate",
    "expand",
    "heart_dataset",
    "image",
    "kinematics",
    "learning",
    "point_tracks",
    "strain_peaks",
    "track",
    "unpack",
]

_ORIGIN = {
    "cases": ("expand",),
    "config": ("Config", "Probe", "Rf", "View"),
    "config.building": ("configure",),
    "config.loading": ("ConfigError",),
    "evaluation.curves": ("strain_peaks",),
    "heart": ("Heart",),
    "imaging.beamforming.scanner": ("Scanner",),
    "imaging.rf.full_matrix": ("FullMatrix",),
    "notebook.datasets": ("heart_dataset",),
    "notebook.kinematics": ("kinematics",),
    "notebook.point_tracks": ("point_tracks",),
    "notebook.simulation": ("beat", "evaluate", "image", "track"),
    "repository.reader": ("Repository",),
    "repository.unpacking": ("unpack",),
    "tracking.failure": ("TrackerFailed",),
}
"""Module to the public names that come from it; it is imported when one of them is first used."""


def __getattr__(name: str) -> Any:
    if name == "learning":
        return import_module("echotruth.learning")
    for module, names in _ORIGIN.items():
        if name in names:
            return getattr(import_module(f"echotruth.{module}"), name)
    raise AttributeError(f"module 'echotruth' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

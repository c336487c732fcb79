"""Synthetic echocardiograms of which the true motion is known everywhere.

>>> import echotruth as et
>>> heart = et.beat(et.configure(geometry={"preset": "mouse"}))  # doctest: +SKIP
>>> clip = et.image(heart, "mid")  # doctest: +SKIP
>>> tracked = et.track(clip, "bspline_dic")  # doctest: +SKIP
>>> et.evaluate(tracked, heart)["nrmse_percent"]  # doctest: +SKIP
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_ORIGIN = {
    "Bmode": "config",
    "Config": "config",
    "ConfigError": "config.loading",
    "FullMatrix": "imaging.rf.full_matrix",
    "Heart": "heart",
    "Probe": "config",
    "Rf": "config",
    "Scanner": "imaging.beamforming.scanner",
    "View": "config",
    "beat": "simulation",
    "configure": "simulation",
    "evaluate": "simulation",
    "image": "simulation",
    "open": "simulation",
    "track": "simulation",
}
"""Public name to the module it comes from; that is imported when the name is first used."""


def __getattr__(name: str) -> Any:
    if name not in _ORIGIN:
        raise AttributeError(f"module 'echotruth' has no attribute {name!r}")
    return getattr(import_module(f"echotruth.{_ORIGIN[name]}"), name)


def __dir__() -> list[str]:
    return [*_ORIGIN, "__version__"]

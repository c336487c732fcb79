"""Synthetic echocardiograms of which the true motion is known everywhere.

>>> import echotruth as et
>>> heart, clip = et.sample().heart("infarct"), et.sample().clip("infarct", "mid")
>>> tracked = et.track(clip, "bspline_dic")
>>> bool(et.evaluate(tracked, heart)["nrmse_percent"] < 50)
True

A heart of one's own, and its clip, take a minute each:

>>> heart = et.beat(et.configure(geometry={"preset": "mouse"}))  # doctest: +SKIP
>>> clip = et.image(heart, "mid")  # doctest: +SKIP
"""

from typing import Any

import lazy_loader

from echotruth.extras import explained

__version__ = "0.2.0"

# Modules are imported when one of their names is first used; __init__.pyi lists them.
_imported, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    with explained(f"echotruth.{name}"):
        return _imported(name)

"""The scripts that run in the browser, so that playing needs no answer from the server."""

from importlib.resources import files
from typing import Any

from bokeh.models import CustomJS


def callback(name: str, **arguments: Any) -> CustomJS:
    """A script as what is done when a property changes or an event happens.

    Parameters
    ----------
    name : str
        File in this folder, without its suffix.
    **arguments
        Models, or lists of them, by the names that they have in the script.
    """
    text = (files("echotruth.viewer") / f"{name}.js").read_text(encoding="utf-8")
    return CustomJS(args=arguments, code=text)

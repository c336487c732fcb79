"""What follows from the presets of a configuration: the data in presets.yaml, whose comments have the sources."""

from pathlib import Path
from typing import Any

from echotruth.config.reading import read_yaml

PRESETS: dict[str, Any] = read_yaml(Path(__file__).with_suffix(".yaml"))
"""Kind of preset -> its name -> values of keys."""

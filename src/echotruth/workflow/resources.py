"""Time and memory that a job asks a cluster for (`runtime`, `mem_mb` of its rule), from the size of its work.

Asked is three times the time and one and a half times the memory, because nodes differ.
"""

from math import ceil

from echotruth.config import Config
from echotruth.workflow.cost import CELLS, PIXELS, cells, lens_size, seconds
from echotruth.workflow.imaged_tissue import scatterers, wall_scatterers

TIME_MARGIN = 3.0
"""Time asked for over the time expected."""
MEMORY_MARGIN = 1.5
"""Memory asked for over the memory expected."""
START_AND_COMPILE_SECONDS = 120.0
"""Time to start a process and, once, to compile its functions, s; for what is asked, not for what is expected."""
BASE_MB = 400.0
"""Memory of a process with its modules."""
SCATTERERS, FRAMES = 196_000, 40
"""Scatterers and frames of the default heart, over which memory is fitted."""


def minutes(rule: str, config: Config, view: str = "", size: int = 0) -> int:
    """Time that a job asks for, min; the arguments are those of :func:`.cost.units`."""
    return ceil(TIME_MARGIN * (START_AND_COMPILE_SECONDS + seconds(rule, config, view, size)) / 60)


def megabytes(rule: str, config: Config, view: str = "", size: int = 0) -> int:
    """Memory that a job asks for, MB; the arguments are those of :func:`.cost.units`."""
    return 100 * ceil(MEMORY_MARGIN * expected_megabytes(rule, config, view, size) / 100)


def expected_megabytes(rule: str, config: Config, view: str = "", size: int = 0) -> float:
    """Peak memory of a job, MB; the arguments are those of :func:`.cost.units`."""
    frames = config.loop.frames / FRAMES
    match rule:
        case "mechanics" if config.motion.kind == "file":
            return BASE_MB + 180 * frames * cells(config) / CELLS
        case "mechanics":
            mesh = cells(config) / CELLS
            return BASE_MB + 400 * mesh ** (4 / 3) + 50 * frames * mesh
        case "phantom" | "rf":
            # The tables of the lens are gone when echoes are made.
            tables = 300 + 130 * lens_size(config) ** 4 if config.rf.elevation_beam else 0.0
            lines = 450 * max(sum(scatterers(config, view)), wall_scatterers(config)) / SCATTERERS
            return max(500.0, tables, BASE_MB + frames * (lines + (2000 if "channels" in config.rf.keep else 0)))
        case "truth" | "bmode" | "tracking":
            return BASE_MB + 720 * frames * size**2 / PIXELS
        case _:
            return 1100 + 0.1 * config.cases.number * len(config.views)

"""CPU time that a job is expected to take: units of its work, from the configuration, times seconds a unit.

Before the first heart the seconds are those of a reference machine. Then the jobs that have ended tell how fast this
one is, by the files that Snakemake's `benchmark` writes.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import islice
from math import sqrt
from pathlib import Path
from statistics import median
from typing import Any

from echotruth.config import Config
from echotruth.repository.benchmark_files import core_seconds
from echotruth.workflow.imaged_tissue import areas, scatterers, wall_scatterers
from echotruth.workflow.jobs import places

START_CPU_SECONDS = 0.6
"""CPU time of a process before its work, s, without compilation, which only the first jobs do."""
REFERENCE = {
    **{"mechanics": 0.235, "phantom": 0.22, "rf": 5.9, "truth": 5.4, "bmode": 0.05, "tracking": 1.0},
    **{"inference": 1.0, "repository": 0.03, "report": 8.0},
}
"""CPU time of a unit of each rule, s, on one core of an Intel Xeon (model 167) that made `config/demo.yaml`."""
TRACKERS = {
    **{"phase_correlation": 0.012, "window_deformation": 0.065, "affine_dic": 0.16, "bspline_dic": 0.13},
    **{"dis": 0.028, "ilk": 0.85, "external": 0.08},
}
"""CPU time of a method for a frame of 512 px of the default heart, one way around the cycle, s, on the same machine; of
a tracker from outside, which may take any time, an example."""
FILE_CELLS = 60_000
"""Tetrahedra assumed in a mesh from a file, whose size is not known before it is read."""
CELLS, POINTS, PIXELS = 4320, 760, 512**2
"""Tetrahedra, tracked points and pixels of the default heart."""
MAX_FILES = 200
"""Largest number of benchmark files that are read of a rule."""


def seconds(rule: str, config: Config, view: str = "", size: int = 0) -> float:
    """CPU time of a job on the reference machine, s; the arguments are those of :func:`units`."""
    return START_CPU_SECONDS + REFERENCE[rule] * units(rule, config, view, size)


def mean_seconds(rule: str, configs: Sequence[Config]) -> float:
    """Mean CPU time of the jobs that some hearts have of a rule, on the reference machine, s."""
    jobs = [(config, *place) for config in configs for place in places(rule, config)]
    return sum(seconds(rule, *job) for job in jobs) / len(jobs)


def units(rule: str, config: Config, view: str = "", size: int = 0) -> float:
    """Work of a job, in units that scale with its time.

    Parameters
    ----------
    rule : str
    config : Config
        Configuration of one case; of all, for the rules that have one job.
    view : str
        Name of the view, for rules that have a job for each.
    size : int
        Image size, px, likewise.
    """
    return UNITS[rule](config, view, size)


def cells(config: Config) -> float:
    """Tetrahedra of the mesh."""
    geometry = config.geometry
    if (geometry.file or config.motion.kind == "file") and not geometry.remesh:
        return FILE_CELLS
    # Each hexahedron is cut into five tetrahedra.
    return 5 * geometry.circumferential_elements * geometry.longitudinal_elements * geometry.transmural_elements


def lens_size(config: Config) -> float:
    """Height of the elements in wavelengths, over that of the array for mice."""
    probe = config.probe
    return probe.height_mm * probe.frequency_MHz * 1e3 / probe.sound_speed_m_per_s / 16.2


def wall_pixels(config: Config, view: str, size: int) -> float:
    """Pixels of the wall in one frame."""
    return areas(config, view)[1] * (size / config.bmode.field_of_view_mm) ** 2


def _mechanics(config: Config) -> float:
    """Frames of the default mesh; a Newton step takes cells^1.3 (benchmarks/results/mechanics.md)."""
    size, frames = cells(config) / CELLS, config.loop.frames
    if config.motion.kind == "file":
        return 0.55 * frames * size
    if config.motion.kind != "beat":
        return 2.4 + size * (5.2 + 0.17 * frames)
    # The steps that inflate the heart and carry it through the cycle depend little on the number of frames.
    step = size**1.3
    # The healthy heart's beat, and one to five in the circulation (docs/physiology.md).
    beats = 4 if config.loop.kind == "circulation" else 1
    return beats * (88 * step + frames * (0.6 + step)) * (2 if config.geometry.given_state == "end_diastole" else 1)


def _phantom(config: Config, view: str) -> float:
    """Scatterers that are seeded and moved; the tables of the lens take as long as some million."""
    seeded = max(sum(scatterers(config, view)), wall_scatterers(config))
    return 4.9e6 * lens_size(config) ** 1.5 + config.loop.frames * seeded


def _rf(config: Config, view: str) -> float:
    """Echoes of single scatterers, and what takes as long: the lines that are made from them, and channels kept."""
    rf, elements = config.rf, config.probe.elements / 64
    waves = rf.lines * rf.focal_zones if rf.transmit == "focused" else 8 * (rf.transmits + rf.lines)
    heart, around = scatterers(config, view)
    # Many of those around the heart, and at the apex, are so near the array that every pair of elements is computed.
    # What is around the heart fills the scan, whose sectors take time each.
    echoes = (1.3 if config.views[view].plane == "long_axis" else 1.0) * heart + 2.1 * around + 42_000 * (around > 0)
    echoes *= sqrt(elements) * (lens_size(config) ** 1.5 if rf.elevation_beam else 0.55)
    lines = (130_000 if "channels" in rf.keep else 17_000) * elements**2 + 67 * elements * waves
    return 130_000 + 330 * elements * waves + config.loop.frames * (echoes + lines)


def _tracking(config: Config, view: str, size: int) -> float:
    """CPU time of all trackers of a clip and of their scores, s."""
    tracking, frames, scale = config.tracking, config.loop.frames, 12 / config.bmode.field_of_view_mm
    points = wall_pixels(config, view, max(config.bmode.sizes)) / tracking.grid_px**2
    methods = [_tracker(one, size**2 / PIXELS, points / POINTS, scale) for one in tracking.trackers.values()]
    return 0.1 + frames / tracking.frame_step * sum(methods) + 1.9e-6 * len(methods) * frames * points


def _tracker(tracker: Any, pixels: float, points: float, scale: float) -> float:
    """CPU time of a tracker for a frame, s.

    Parameters
    ----------
    tracker : Section
    pixels, points : float
        Those of the image and those tracked, over those of the default heart.
    scale : float
        By what lengths are multiplied for the field of view of the default heart.
    """
    ways = 2.0 if getattr(tracker, "reference", "") == "bidirectional" else 1.0
    amount = ways * (0.1 + 0.9 * pixels)
    match tracker.method:
        case "phase_correlation":
            amount *= (0.75 if ways == 2 else 1.0) * (0.5 / tracker.stride) ** 2
        case "window_deformation":
            amount *= (tracker.final_passes + 1) / 4
        case "affine_dic":
            amount = ways * points * (0.1 + 0.9 * pixels * (tracker.subset_mm * scale) ** 2)
        case "dis" if tracker.preset == "fine":
            amount *= 4.7
        case "bspline_dic":
            amount = ways * sqrt(pixels * points) * 0.4 / (tracker.knots_mm * scale)
    return amount * TRACKERS[tracker.method]


UNITS: dict[str, Callable[[Config, str, int], float]] = {
    "mechanics": lambda config, *_: _mechanics(config),
    "phantom": lambda config, view, _: _phantom(config, view) / 1e6,
    "rf": lambda config, view, _: _rf(config, view) / 1e6,
    "truth": lambda config, view, size: config.loop.frames * wall_pixels(config, view, size) / 1e6,
    "bmode": lambda config, _, size: config.loop.frames * size**2 / 1e6,
    "tracking": _tracking,
    "inference": lambda config, *_: 40 + config.loop.frames,
    "repository": lambda config, *_: 30 + config.cases.number * len(config.views),
    "report": lambda *_: 1.0,
}
"""Rule -> work of one of its jobs."""


def speed(folder: Path, configs: Mapping[str, Config]) -> dict[str, float]:
    """Time of jobs over that on the reference machine, by rule; none of a rule of which no job has ended.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    configs : mapping
        Case -> its configuration.
    """
    found = {}
    for rule in REFERENCE:
        at = folder / "benchmarks" / rule
        ratios = []
        for file in islice(at.rglob("*.tsv"), MAX_FILES):
            case, *place = file.relative_to(at).with_suffix("").parts
            view, size = "".join(place[:1]), int("".join(place[1:]) or 0)
            config, took = configs.get(case), core_seconds(file)
            if config and took and (not view or view in config.views):
                ratios.append(took / seconds(rule, config, view, size))
        if ratios:
            # Not the mean, because the first job of a rule also compiles.
            found[rule] = median(ratios)
    return found

"""CPU time and memory that a job is expected to take: those of the default heart, times what scales them."""

from math import ceil, prod

from echotruth.config import Config

SECONDS = {
    **{"mechanics": 60, "phantom": 4, "rf": 36, "truth": 17, "bmode": 4, "points": 4, "tracking": 9, "inference": 90},
    **{"repository": 1, "report": 22},
}
"""CPU time of a job of each rule for the default heart (40 frames, 512 px), s, on a core of an AMD EPYC (Zen 4); of
tracking, that of a tracker in three sizes."""
SECONDS_OF_VOLUMES = SECONDS | {"phantom": 4, "rf": 363, "truth": 16, "bmode": 14, "points": 4, "tracking": 242}
"""Likewise of the default heart in 40 volumes of 144 x 128 x 96 voxels, without blood and surroundings."""
MEGABYTES = {
    **{
        "mechanics": 900,
        "phantom": 1100,
        "rf": 1100,
        "truth": 1500,
        "bmode": 1100,
        "points": 600,
        "tracking": 1200,
        "inference": 1200,
    },
    **{"repository": 600, "report": 1200},
}
"""Memory of a job of each rule for the default heart, MB."""
MEGABYTES_OF_VOLUMES = MEGABYTES | {"rf": 800, "truth": 1100, "bmode": 1500, "tracking": 1300}
"""Likewise in volumes."""
FRAMES, PIXELS, CELLS, VOXELS = 40, 512**2, 4320, 144 * 128 * 96
"""Frames, pixels and tetrahedra of the default heart, and voxels of a volume."""
FILE_CELLS = 60_000
"""Tetrahedra assumed in a mesh from a file, whose size is not known before it is read."""
MEGABYTES_OF_FRAME = 1.2
"""Size on disk of a frame of a view of the default heart, in three sizes, MB, with its lines and six trackers."""
MEGABYTES_OF_VOLUME = 7.2
"""Likewise of a volume of 144 x 128 x 96 voxels and one tracker."""
FILES_OF_HEART, FILES_OF_VIEW, FILES_OF_SIZE, FILES_OF_TRACKER = 205, 105, 40, 41
"""Files of a heart, of a view, and of a view more for each image size and for each tracker (docs/size.md)."""


def scale(rule: str, config: Config) -> float:
    """Work of a job over that for the default heart."""
    geometry, frames = config.geometry, config.loop.frames / FRAMES
    pixels = _pixels(config)
    if rule == "mechanics":
        elements = geometry.circumferential_elements * geometry.longitudinal_elements * geometry.transmural_elements
        cells = FILE_CELLS if geometry.file and not geometry.remesh else 5 * elements
        beats = 4 if config.loop.kind == "circulation" else 1
        return beats * (cells / CELLS) ** 1.3 * (0.4 + 0.6 * frames)
    if rule in ("phantom", "rf"):
        of_array = pixels if config.has_volumes else config.probe.elements / 64
        return frames * of_array * (2 if config.realism.surroundings.level_dB is not None else 1)
    if rule in ("truth", "bmode"):
        return frames * pixels
    if rule == "tracking" and config.has_volumes:
        return frames * pixels
    if rule == "tracking":
        return frames * sum(0.1 + 0.9 * size**2 / PIXELS for size in config.bmode.sizes) / 1.5
    return frames if rule == "points" else 1.0


def _pixels(config: Config) -> float:
    """Pixels of the largest image, or voxels of a volume, over those of the default heart."""
    return prod(config.volume.size) / VOXELS if config.has_volumes else max(config.bmode.sizes) ** 2 / PIXELS


def seconds(rule: str, config: Config) -> float:
    """CPU time of a job, s."""
    return 1.0 + (SECONDS_OF_VOLUMES if config.has_volumes else SECONDS)[rule] * scale(rule, config)


def megabytes(rule: str, config: Config) -> float:
    """Peak memory of a job, MB."""
    of_default = (MEGABYTES_OF_VOLUMES if config.has_volumes else MEGABYTES)[rule]
    return of_default * max(0.5, scale(rule, config)) ** 0.7


def resources(rule: str, config: Config) -> dict[str, int]:
    """What a job asks a cluster for: three times the time and one and a half times the memory, as nodes differ.

    Returns
    -------
    dict
        `runtime`, min, with two for compilation, and `mem_mb`.
    """
    minutes = 2 + 3 * seconds(rule, config) / 60
    return {"runtime": ceil(minutes), "mem_mb": 100 * ceil(1.5 * megabytes(rule, config) / 100)}


def jobs(config: Config, hearts: int, cases: int) -> dict[str, int]:
    """Number of jobs of each rule.

    Parameters
    ----------
    config : Config
    hearts, cases : int
        A heart may serve several cases.
    """
    views = cases * len(config.views)
    found = {"mechanics": hearts} | dict.fromkeys(("phantom", "rf", "truth", "bmode", "points"), views)
    found["tracking"] = views * len(config.tracking.trackers)
    return found | ({"inference": cases} if config.inference.tracker else {}) | {"repository": 1, "report": 1}


def chain(config: Config) -> float:
    """Time of the longest chain of jobs that wait for each other, s: no number of cores makes a run shorter."""
    took = {rule: seconds(rule, config) for rule in jobs(config, 1, 1)}
    images, beside = took["phantom"] + took["rf"] + took["bmode"], (took["truth"], took["points"])
    return sum(took.values()) - images - sum(beside) + max(images, *beside)


def table(config: Config, hearts: int, cases: int, cores: int) -> str:
    """What a run will take, a line for each rule: jobs and CPU time, and what the repository takes on disk."""
    lines, total = [f"{'':13} {'jobs':>7} {'CPU time':>9}"], 0.0
    for rule, number in jobs(config, hearts, cases).items():
        took = number * seconds(rule, config)
        lines.append(f"{rule:13} {number:>7} {duration(took):>9}")
        total += took
    views = cases * len(config.views)
    size_MB = views * config.loop.frames * _pixels(config)
    size_MB *= MEGABYTES_OF_VOLUME if config.has_volumes else MEGABYTES_OF_FRAME
    disk = f"{size_MB / 1e3:.1f} GB" if size_MB >= 1e3 else f"{size_MB:.0f} MB"
    of_view = FILES_OF_VIEW + FILES_OF_SIZE * len(config.image_names) + FILES_OF_TRACKER * len(config.tracking.trackers)
    number = hearts * FILES_OF_HEART + views * of_view
    took = max(total / cores, chain(config))
    lines += ["", f"Time: {duration(total)} of CPU time, about {duration(took)} on {cores} cores"]
    lines += [f"Disk: {disk}, about {number} files", "Based on the default heart on a core of an AMD EPYC"]
    return "\n".join(lines)


def duration(seconds: float) -> str:
    """Rounded duration, such as `2 min`."""
    if seconds < 50:
        return f"{max(10, 10 * round(seconds / 10))} s"
    if seconds < 5400:
        return f"{round(seconds / 60)} min"
    return f"{seconds / 3600:.1f} h" if seconds < 100 * 3600 else f"{seconds / 86_400:.1f} days"

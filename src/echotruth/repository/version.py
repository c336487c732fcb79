"""Versions of results: a hash of the settings and the code that a group was made with, and of all before it.

If the version of a group is that of the configuration, so are its bytes. A group has it in its attributes. That of a
stage is a hash of its settings, its code (:mod:`.code`) and the versions of the stages before it.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from functools import cache, lru_cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from echotruth.config import Config, Geometry, Loop
from echotruth.loop.cycle import frame_times, recorded_curves, size
from echotruth.repository.checksums import CHECKSUMS, checksum
from echotruth.repository.code import code_hash
from echotruth.section import Section

PACKAGES = (
    "echotruth",
    "numpy",
    "scipy",
    "numba",
    "scikit-image",
    "pypardiso",
    "mkl",
    "meshio",
    "vtk",
    "xarray",
    "zarr",
    "onnxruntime",
)
"""Packages whose version may affect the numbers, besides OpenCV, which is installed under several names."""

BEFORE: dict[str, tuple[str, ...]] = {
    "mechanics": (),
    "phantom": ("mechanics",),
    "rf": ("phantom",),
    "truth": ("mechanics",),
    "bmode": ("rf",),
    "points": ("mechanics",),
    "tracking": ("truth", "bmode", "points"),
    "inference": ("truth", "tracking"),
}
"""Stages -> those whose groups they read, without those whose version is in that of another one."""

Settings = tuple[Any, ...]


class Versions:
    """Versions of the groups of one case.

    Parameters
    ----------
    config : Config
        Of the case.
    excluded : str
        Why the heart is not imaged, if it is not.
    """

    def __init__(self, config: Config, excluded: str = "") -> None:
        self._config, self._excluded = config, excluded
        self._known: dict[tuple[str | None, ...], str] = {}

    def of(self, stage: str, view: str | None = None, tracker: str | None = None) -> str:
        """Version of what a stage makes; the parameters are those of :func:`version_of`."""
        key = stage, None if stage == "mechanics" else view, tracker if stage in ("tracking", "inference") else None
        if key not in self._known:
            self._known[key] = self._of(stage, view, tracker)
        return self._known[key]

    def _of(self, stage: str, view: str | None, tracker: str | None) -> str:
        if stage == "inference":
            views, tracker = list(self._config.views), self._config.inference.tracker
        else:
            views = [str(view)]
        before = [self.of(one, name, tracker) for name in views for one in BEFORE[stage]]
        own = SETTINGS[stage](self._config, str(view), str(tracker)) if stage in SETTINGS else ()
        code = code_hash(stage, _named(stage, self._config, str(tracker)), _unused(self._config))
        excluded = "" if stage == "mechanics" else self._excluded
        return settings_hash(before, own, code, excluded)


def version_of(
    stage: str, config: Config, view: str | None = None, tracker: str | None = None, excluded: str = ""
) -> str:
    """Version of what a stage makes.

    Parameters
    ----------
    stage : str
    config : Config
        Of the case.
    view : str, optional
        For the stages of a view.
    tracker : str, optional
        For tracking.
    excluded : str
        Why the heart is not imaged, if it is not.

    Returns
    -------
    str of 16 hexadecimal digits
    """
    return Versions(config, excluded).of(stage, view, tracker)


def _named(stage: str, config: Config, tracker: str) -> list[str]:
    """Modules that a stage imports by a name in the configuration."""
    if stage in ("mechanics", "inference"):
        return [f"echotruth.materials.{config.mechanics.material.law}"]
    if stage == "tracking":
        return [f"echotruth.tracking.trackers.{config.tracking.trackers[tracker].method}"]  # type: ignore[attr-defined]
    return []


def _unused(config: Config) -> list[str]:
    """Modules that read files, where the configuration names none."""
    readers = {
        "echotruth.mechanics.geometry.file": config.geometry.file is not None,
        "echotruth.mechanics.motion_file": config.motion.kind == "file",
    }
    return [name for name, is_used in readers.items() if not is_used]


def settings_hash(*settings: Any) -> str:
    """Hash of sections and plain values. Their order counts, as that of the trackers is that of the arrays."""
    return sha256(json.dumps(settings, default=_plain).encode()).hexdigest()[:16]


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if isinstance(value, Section) else str(value)


def packages() -> dict[str, str]:
    """Versions of echotruth and of the packages that may affect the numbers, by name."""
    versions: dict[str, str] = {}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    with suppress(ImportError):  # some distributions of OpenCV carry no metadata: ask the module itself
        import cv2

        versions["opencv"] = cv2.__version__
    return versions


def report_version(folder: Path) -> str:
    """Version of the report of a repository: of all that is published, and of the code that draws it."""
    return settings_hash(checksum(folder / CHECKSUMS), code_hash("report"))


def _mechanics(config: Config, view: str, tracker: str) -> Settings:
    """What the motion of a heart depends on, with the content of the files that it names."""
    # Only fibre disarray depends on the seed.
    seed = config.seed if config.fibres.disarray_deg else None
    anatomy = (config.geometry.resolved(), config.fibres, seed, config.pathology.resolved())
    kind, mesh = config.motion.kind, _mesh_hash(config.geometry)
    if kind == "beat":
        return (*anatomy, config.loop, config.mechanics, mesh, _curves(config.loop, size(config)))
    prescribed = (_times(config.loop), config.motion.time_course, getattr(config.motion, kind), config.rf.focus_mm)
    series = [_series_hash(str(config.motion.file.path))] if kind == "file" else []
    return (*anatomy, *prescribed, mesh, *series)


def _phantom(config: Config, view: str, tracker: str) -> Settings:
    """What the scatterers of a view depend on, and their echoes: the group `rf` has no settings of its own."""
    levels = config.realism.model_dump(mode="json", exclude={"preset"})
    of_array = config.probe.resolved(), config.rf, levels, config.depth_mm
    return (config.seed, config.views[view], config.phantom, *of_array, *_voxels(config))


def _truth(config: Config, view: str, tracker: str) -> Settings:
    """What the truth of a view depends on."""
    return (*_image(config), config.depth_mm, config.views[view], config.rf.focus_mm, *_neighbours(config))


def _image(config: Config) -> Settings:
    """Side of the images and their pixels; smaller images are made of the largest."""
    return (config.bmode.field_of_view_mm, config.bmode.size_px, config.bmode.sizes[0], *_voxels(config))


def _voxels(config: Config) -> Settings:
    """Voxels of views that are volumes."""
    return (config.volume,) if config.has_volumes else ()


def _neighbours(config: Config) -> Settings:
    """What the labels of the neighbours depend on, besides the heart and the view."""
    present = [level is not None for level in config.realism.neighbours.model_dump().values()]
    if not any(present):
        return (present,)
    surroundings = config.realism.surroundings
    return present, surroundings.start_mm, surroundings.motion_decay_mm, config.probe.resolved(), config.rf


def _bmode(config: Config, view: str, tracker: str) -> Settings:
    """What the largest images of a view depend on; smaller ones are made of these."""
    return config.bmode.model_copy(update={"downsampling": (1,)}), config.bmode.sizes[0]


def _points(config: Config, view: str, tracker: str) -> Settings:
    """What the true motion of the points depends on."""
    return (*_image(config), config.depth_mm, config.views[view], config.rf.focus_mm, config.tracking.grid)


def _tracking(config: Config, view: str, tracker: str) -> Settings:
    """What a tracker finds in a view: also what the files hold that one from outside names."""
    settings, tracking = config.tracking.trackers[tracker], config.tracking
    words = [word for word in getattr(settings, "files", []) if Path(word).is_file()]
    given = config.seed, config.bmode.sizes, tracking.frame_step, settings
    return (*given, [_content_of(Path(word)) for word in words])


def _inference(config: Config, view: str, tracker: str) -> Settings:
    """What is inferred: the table of errors leaves out the rows of the heart itself, by these names."""
    return config.inference, errors_of(config), config.name, list(config.views), config.bmode.sizes[0]


SETTINGS: dict[str, Callable[[Config, str, str], Settings]] = {
    "mechanics": _mechanics,
    "phantom": _phantom,
    "truth": _truth,
    "bmode": _bmode,
    "points": _points,
    "tracking": _tracking,
    "inference": _inference,
}
"""Stages -> their settings, besides what the stages before them depend on."""


def errors_of(config: Config) -> str:
    """Hash of the table of the tracker's errors that is used in inference; "" if it is that of the package, or none."""
    path = Path(config.inference.errors or "")
    return _content_of(path) if path.is_file() else ""


def _content_of(path: Path) -> str:
    """Hash of a file, which is read anew where its date is another."""
    return _file_hash(path.absolute(), path.stat().st_mtime_ns)


@cache
def _file_hash(path: Path, date: int) -> str:
    return sha256(path.read_bytes()).hexdigest()[:16]


@lru_cache(maxsize=1000)
def _curves(loop: Loop, of_heart: float) -> dict[str, Any]:
    """Curves that are prescribed, read once for all hearts that share them."""
    found = recorded_curves(loop, of_heart)
    return {name: None if values is None else values.tolist() for name, values in found.items()}


@lru_cache(maxsize=1000)
def _times(loop: Loop) -> list[float]:
    """Times of the frames, s."""
    return frame_times(loop).tolist()


def _mesh_hash(geometry: Geometry) -> str:
    """Hash of the mesh file, or an empty string; modules that read meshes, and compile, are loaded only for one."""
    if geometry.file is None:
        return ""
    from echotruth.mechanics.geometry.imported_mesh import fingerprint

    return fingerprint(geometry)


def _series_hash(path: str) -> str:
    """Hash of all files of a series."""
    from echotruth.mechanics.motion_file.files import content_hash

    return content_hash(path)

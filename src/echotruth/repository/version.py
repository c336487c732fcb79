"""Versions of results: a hash of the settings and the code that a group was made with, and of all before it.

If the version of a group is that of the configuration, so are its bytes. A group has it in its attributes.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from functools import cache, lru_cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from echotruth.config import Config, Geometry, Loop, shipped
from echotruth.loop.cycle import frame_times, recorded_curves, size
from echotruth.section import Section

PACKAGE = Path(__file__).parents[1]
"""Folder of echotruth."""

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

_ROUNDED = ("repository/rounding.py", "repository/arrays.csv")
_HEART = (*_ROUNDED, "aha.py", "arrays.py", "fem", "heart.py", "loop", "materials", "mechanics")
_IMAGING = (*_HEART, "seeds.py", "imaging")
_TRACKING = (*_IMAGING, "tracking", "evaluation")
CODE = {
    "mechanics": _HEART,
    "phantom": _IMAGING,
    "rf": _IMAGING,
    "truth": _IMAGING,
    "bmode": _IMAGING,
    "tracking": _TRACKING,
    "inference": (*_TRACKING, "notebook", "inference"),
}
"""Folders and modules of the package on which a stage depends; the configuration and the repository pass numbers on,
but for their rounding."""

NO_RF = tuple(f"imaging/{name}.py" for name in ("bmode", "truth", "flow", "tracks", "doppler", "packet"))
"""Modules of imaging that phantom and rf do not use."""

BEFORE = {
    "mechanics": (),
    "phantom": ("mechanics",),
    "rf": ("mechanics", "phantom"),
    "truth": ("mechanics",),
    "bmode": ("mechanics", "phantom", "rf"),
    "tracking": ("mechanics", "phantom", "rf", "truth", "bmode"),
    "inference": ("mechanics", "phantom", "rf", "truth", "bmode", "tracking"),
}
"""Stages -> those before them."""

Settings = tuple[Any, ...]


def version_of(stage: str, config: Config, view: str | None = None, excluded: str = "") -> str:
    """Version of what a stage makes.

    Parameters
    ----------
    stage : str
    config : Config
        Of the case.
    view : str, optional
        For the stages of a view.
    excluded : str
        Why the heart is not imaged, if it is not.

    Returns
    -------
    str of 16 hexadecimal digits
    """
    views = [view] if view is not None else list(config.views) if stage == "inference" else []
    settings = [SETTINGS[one](config, name) for name in views for one in (*BEFORE[stage], stage) if one in SETTINGS]
    own: Settings = (config.bmode.sizes[0],) if stage in ("truth", "bmode", "tracking") else ()
    if stage == "inference":
        # The table of errors leaves out the rows of the heart itself, by these names.
        own = config.inference, errors_of(config), config.name, views, config.bmode.sizes[0]
    return settings_hash(*_motion(config), *_content(config), *settings, *own, excluded, code_hash(stage))


def settings_hash(*settings: Any) -> str:
    """Hash of sections and plain values. Their order counts, as that of the trackers is that of the arrays."""
    return sha256(json.dumps(settings, default=_plain).encode()).hexdigest()[:16]


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if isinstance(value, Section) else str(value)


@cache
def code_hash(stage: str) -> str:
    """Hash of the scripts of a stage and of those before it, and of the files of the package on which it depends."""
    left_out = {PACKAGE / name for name in NO_RF} if stage in ("phantom", "rf") else set()
    digest = sha256()
    for name in (*BEFORE[stage], stage):
        digest.update((shipped.ROOT / f"workflow/scripts/{name}.py").read_bytes())
    for part in CODE[stage]:
        path = PACKAGE / part
        files = sorted(path.rglob("*")) if path.is_dir() else [path]
        for file in (file for file in files if file.suffix in (".py", ".csv", ".npz") and file not in left_out):
            digest.update(file.relative_to(PACKAGE).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()[:16]


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


def motion_hash(config: Config) -> str:
    """Hash of what the motion of a heart depends on: the same for hearts that move alike."""
    return settings_hash(*_motion(config), *_content(config))


def _motion(config: Config) -> Settings:
    """What the motion of a heart depends on, besides the content of the files that it names."""
    # Only fibre disarray depends on the seed.
    seed = config.seed if config.fibres.disarray_deg else None
    anatomy = (config.geometry.resolved(), config.fibres, seed, config.pathology)
    if config.motion.kind == "beat":
        return (*anatomy, config.loop, config.mechanics)
    formula = getattr(config.motion, config.motion.kind)
    return (*anatomy, _times(config.loop), config.motion.time_course, formula, config.rf.focus_mm)


def _content(config: Config) -> Settings:
    """What the files that a heart names hold."""
    found: list[Any] = [_mesh_hash(config.geometry)]
    if config.motion.kind == "beat":
        found.append(_curves(config.loop, size(config)))
    if config.motion.kind == "file":
        found.append(_series_hash(str(config.motion.file.path)))
    return tuple(found)


def _phantom(config: Config, view: str) -> Settings:
    """What the scatterers of a view depend on, and their echoes: the group `rf` has no settings of its own."""
    depth = config.bmode.field_of_view_mm
    levels = config.realism.model_dump(mode="json", exclude={"preset"})
    return config.seed, config.views[view], config.phantom, config.probe.resolved(), config.rf, levels, depth


def _truth(config: Config, view: str) -> Settings:
    """What the truth of a view depends on."""
    image = config.bmode.field_of_view_mm, config.bmode.size_px
    return config.views[view], config.rf.focus_mm, *image, *_neighbours(config)


def _neighbours(config: Config) -> Settings:
    """What the labels of the neighbours depend on, besides the heart and the view."""
    present = [level is not None for level in config.realism.neighbours.model_dump().values()]
    if not any(present):
        return (present,)
    surroundings = config.realism.surroundings
    return present, surroundings.start_mm, surroundings.motion_decay_mm, config.probe.resolved(), config.rf


def _bmode(config: Config, view: str) -> Settings:
    """What the largest images of a view depend on; smaller ones are made of these."""
    return config.bmode.model_copy(update={"downsampling": (1,)}), config.probe.resolved(), config.rf


def _tracking(config: Config, view: str) -> Settings:
    """What trackers find in a view: also what the files hold that a tracker from outside names."""
    words = [word for tracker in config.tracking.trackers.values() for word in getattr(tracker, "files", [])]
    return config.seed, config.tracking, [_content_of(Path(word)) for word in words if Path(word).is_file()]


SETTINGS: dict[str, Callable[[Config, str], Settings]] = {
    "phantom": _phantom,
    "truth": _truth,
    "bmode": _bmode,
    "tracking": _tracking,
}
"""Stages of a view -> their settings, besides what the stages before them depend on."""


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

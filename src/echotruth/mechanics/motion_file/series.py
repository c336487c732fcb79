"""Series of meshes, or of positions of the points of one mesh, as the files hold them."""

import glob
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from echotruth.arrays import Floats
from echotruth.config.defaults import ARRAY_SUFFIXES
from echotruth.config.motion import FileMotion
from echotruth.mechanics.geometry.imported_mesh import ImportedMesh, read_files
from echotruth.mechanics.geometry.mesh_quality import GeometryError
from echotruth.mechanics.motion_file.files import series_files
from echotruth.mechanics.prescribed import MotionError

MESH_SUFFIXES = (".vtk", ".vtu", ".pvtu", ".msh")
COLLECTION = ".pvd"

STILL = 1e-9
"""Motion over the size of the heart below which points are at rest."""


@dataclass(frozen=True)
class MeshSeries:
    """Positions of points over time, in the unit of their file.

    Attributes
    ----------
    source : str
        The path that was configured, for errors.
    names : list of str
        Of the frames, for errors.
    positions : ndarray of shape (n_frames, n_points, 3)
    times : ndarray of shape (n_frames,) or None
        In any unit.
    mesh : ImportedMesh or None
        That of the first frame, where the files hold meshes.
    """

    source: str
    names: list[str]
    positions: Floats
    times: Floats | None
    mesh: ImportedMesh | None


def is_series(path: str) -> bool:
    """Whether a path is that of a series, not of a single mesh."""
    pattern = glob.has_magic(path) and not Path(path).is_file()
    return pattern or Path(path).suffix.lower() == COLLECTION


def read_series(section: FileMotion, points: Floats | None = None) -> MeshSeries:
    """Read the series of a configuration.

    Parameters
    ----------
    section : FileMotion
        Its path, and the name of the displacement.
    points : ndarray of shape (n_points, 3), optional
        Points of the mesh, to which an array of displacements without a mesh is added.

    Returns
    -------
    MeshSeries

    Raises
    ------
    MotionError, GeometryError
        In one sentence, if a file is missing or cannot be read, or the frames do not share points and cells.
    """
    source = str(section.path)
    files = series_files(source)
    suffix = files[0].suffix.lower()
    try:
        if suffix in ARRAY_SUFFIXES:
            return _array_series(source, section.displacement, points)
        frames, times = _mesh_frames(files, suffix)
    except (MotionError, GeometryError):
        raise
    except Exception as error:  # the libraries do not document what they raise
        reason = (str(error).splitlines() or ["it does not begin as one"])[0].rstrip(".")[:200]
        raise MotionError(f"{source}: cannot be read as {suffix} ({reason}): write the file again.") from None
    return _stack(source, frames, np.array(times, float) if times else None, section.displacement)


def _mesh_frames(files: list[Path], suffix: str) -> tuple[list[ImportedMesh], list[float]]:
    if suffix in MESH_SUFFIXES:
        return read_files([str(file) for file in files]), []
    if suffix == COLLECTION:
        return _pvd_frames(files[0])
    known = ", ".join((*MESH_SUFFIXES, COLLECTION, *ARRAY_SUFFIXES))
    raise MotionError(f"motion.file.path = {str(files[0])!r}: ends in {suffix or 'no suffix'}: give one of {known}.")


def _pvd_frames(path: Path) -> tuple[list[ImportedMesh], list[float]]:
    """Meshes and times of a ParaView data file (.pvd)."""
    entries = list(ElementTree.parse(path).getroot().iter("DataSet"))
    times = [float(entry.get("timestep", "nan")) for entry in entries]
    if len(set(times)) < len(times):
        raise MotionError(f"{path}: holds several parts, or times, more than once: write one mesh for each time.")
    files = [path.parent / str(entry.get("file")) for entry in entries]
    for file in files:
        if not file.is_file():
            raise MotionError(f"{path}: names {file}, which does not exist: keep the files beside it.")
    return read_files([str(file) for file in files]), times


def _stack(source: str, frames: Sequence[ImportedMesh], times: Floats | None, displacement: str | None) -> MeshSeries:
    """One series of meshes that share their cells."""
    if not frames:
        raise MotionError(f"{source}: holds no frames: give at least two.")
    first = frames[0]
    for frame in frames:
        _check_same_mesh(frame, first)
    positions = np.stack([frame.nodes for frame in frames])
    moves = not _at_rest(positions)
    if displacement is not None:
        if moves:
            raise MotionError(
                f"{source}: its points move, and motion.file.displacement = {displacement!r} would move them again: "
                "leave it out."
            )
        positions = positions + np.stack([_displacement(frame, displacement) for frame in frames])
    elif not moves:
        raise MotionError(
            f"{source}: its points are the same in all {len(frames)} frames: name the array of their displacements "
            f"with motion.file.displacement ({_vectors(first)})."
        )
    return MeshSeries(source, [frame.source for frame in frames], positions, times, first)


def _check_same_mesh(frame: ImportedMesh, first: ImportedMesh) -> None:
    if not len(frame.cells):
        raise MotionError(f"{frame.source}: holds no tetrahedra: write those of the wall in every frame.")
    if len(frame.nodes) != len(first.nodes):
        counts = f"has {len(frame.nodes)} points and {first.source} {len(first.nodes)}"
        raise MotionError(f"{frame.source}: {counts}: a motion needs the same points in every frame.")
    if frame.cells is not first.cells and not np.array_equal(frame.cells, first.cells):
        raise MotionError(
            f"{frame.source}: its tetrahedra are not those of {first.source}: a motion needs the same ones, in the "
            "same order, in every frame."
        )


def _displacement(frame: ImportedMesh, name: str) -> Floats:
    if name not in frame.node_arrays:
        raise MotionError(f"{frame.source}: motion.file.displacement = {name!r} is no array of it ({_vectors(frame)}).")
    values = np.asarray(frame.node_arrays[name], float)
    if values.shape != frame.nodes.shape:
        raise MotionError(
            f"{frame.source}: motion.file.displacement = {name!r} has the shape {values.shape}, and must have three "
            f"components at {len(frame.nodes)} points."
        )
    return values


def _vectors(frame: ImportedMesh) -> str:
    names = [name for name, values in frame.node_arrays.items() if np.shape(values) == frame.nodes.shape]
    return f"its vectors over the points are {', '.join(names)}" if names else "it has no vectors over the points"


def _array_series(source: str, displacement: str | None, points: Floats | None) -> MeshSeries:
    """Positions of shape (n_frames, n_points, 3) in a .npy or .npz file."""
    loaded = np.load(source, allow_pickle=False)
    name, times = displacement or "positions", None
    if isinstance(loaded, np.ndarray):
        values = loaded if displacement is None else None
    else:
        values = loaded.get(name)
        times = np.asarray(loaded["times"], float).ravel() if "times" in loaded else None
    if values is None:
        found = "it is a .npy file of positions" if isinstance(loaded, np.ndarray) else f"it has {', '.join(loaded)}"
        raise MotionError(f"{source}: holds no array {name!r} ({found}): name it, or give positions.")
    if values.dtype.kind not in "fiu":
        raise MotionError(f"{source}: {name!r} is an array of {values.dtype}: give real numbers.")
    if values.ndim != 3 or values.shape[2] != 3 or not values.size:
        raise MotionError(f"{source}: has the shape {values.shape}: give positions of shape (frame, point, 3).")
    positions = np.asarray(values, float)
    if points is not None and positions.shape[1:] != points.shape:
        counts = f"moves {positions.shape[1]} points and geometry.file has {len(points)}"
        raise MotionError(f"{source}: {counts}: give positions of all points, in the order of that file.")
    if displacement is not None and points is not None:
        positions = positions + points
    if _at_rest(positions):
        raise MotionError(f"{source}: its points are the same in all {len(positions)} frames: give those that move.")
    return MeshSeries(source, [f"{source}, frame {i}" for i in range(len(positions))], positions, times, None)


def _at_rest(positions: Floats) -> bool:
    """Whether no coordinate changes; not where one is not a number."""
    size = np.ptp(positions[0], axis=0).max()
    return all(bool(np.abs(frame - positions[0]).max() <= STILL * size) for frame in positions)

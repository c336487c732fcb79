"""Reading a wall from a file: tetrahedra or a closed surface, and the arrays over them."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Integers
from echotruth.mechanics.geometry.mesh_quality import GeometryError
from echotruth.mechanics.geometry.vtk_process import read_grids

Arrays = dict[str, NDArray]

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
VOLUME_SUFFIXES, SURFACE_SUFFIXES = (".vtu", ".vtk", ".msh"), (".stl", ".ply", ".vtp")

_TETRAHEDRA, _TRIANGLES = ("tetra", "tetra10"), ("triangle", "triangle6")
_IGNORED_TYPES = ("vertex", "line", "line3", "polygon", "quad", "quad8", "quad9")
"""Cells without a volume, which a file of tetrahedra may hold beside them."""

_VTK_TYPES = {1: "vertex", 2: "vertex", 3: "line", 4: "line", 5: "triangle", 7: "polygon", 9: "quad", 10: "tetra"}
_VTK_TYPES |= {11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8"}
_VTK_TYPES[24] = "tetra10"

_LAGRANGE = {(69, 3): 5, (69, 6): 22, (71, 4): 10, (71, 10): 24}
"""VTK's Lagrange cells of any order, as DOLFINx writes them, with their number of nodes: the same of fixed order."""


@dataclass(frozen=True)
class ImportedMesh:
    """A wall as read, in the coordinates of its file but in metres.

    Attributes
    ----------
    source : str
        The file, for errors.
    nodes : ndarray of shape (n_nodes, 3), m
    cells : ndarray of shape (n_cells, 4 or 10)
        Tetrahedra, nodes in the order of VTK; none in a file that holds a surface.
    triangles : ndarray of shape (n_triangles, 3)
    cell_arrays, triangle_arrays, node_arrays : dict of ndarray
        By name, first dimension that of `cells`, `triangles` and `nodes`.
    physical_groups : dict
        Name of a physical group to its number.
    """

    source: str
    nodes: Floats
    cells: Integers
    triangles: Integers
    cell_arrays: Arrays = field(default_factory=dict)
    triangle_arrays: Arrays = field(default_factory=dict)
    node_arrays: Arrays = field(default_factory=dict)
    physical_groups: dict[str, int] = field(default_factory=dict)


def read(geometry: Geometry) -> ImportedMesh:
    """Read the file of a geometry.

    Parameters
    ----------
    geometry : Geometry
        With a `file`.

    Raises
    ------
    GeometryError
        If the file cannot be read or holds neither tetrahedra nor triangles.
    """
    source = str(geometry.file)
    suffix = Path(source).suffix.lower()
    volumes, surfaces = ", ".join(VOLUME_SUFFIXES), ", ".join(SURFACE_SUFFIXES)
    formats = f"tetrahedra as {volumes}, or a closed surface of the wall as {surfaces}"
    if suffix not in (*VOLUME_SUFFIXES, *SURFACE_SUFFIXES):
        raise GeometryError(f"{source}: geometry.file ends in {suffix or 'no suffix'}: give {formats}")
    if not Path(source).is_file():
        raise GeometryError(f"{source}: geometry.file does not exist: give its path relative to the working directory")
    mesh = read_file(source)
    if not len(mesh.cells) and (suffix in VOLUME_SUFFIXES or not len(mesh.triangles)):
        missing = "tetrahedra" if suffix in VOLUME_SUFFIXES else "triangles"
        raise GeometryError(f"{source}: holds no {missing}: give {formats}")
    if not np.isfinite(mesh.nodes).all():
        raise GeometryError(f"{source}: holds points that are not finite numbers: repair the file")
    return merge_points(replace(mesh, nodes=mesh.nodes * METRES[geometry.unit] * geometry.scale))


def fingerprint(geometry: Geometry) -> str:
    """Hash of the file's content, or an empty string where there is none: a changed file is a changed heart."""
    path = Path(geometry.file) if geometry.file else None
    return _hash(path, path.stat().st_mtime_ns, path.stat().st_size) if path and path.is_file() else ""


@lru_cache(maxsize=100)
def _hash(path: Path, changed: int, size: int) -> str:
    """Hash of a file's content, which is read once as long as its date and size stay."""
    return sha256(path.read_bytes()).hexdigest()[:16]


def read_file(source: str) -> ImportedMesh:
    """All points and cells of a file, in its own unit.

    Raises
    ------
    GeometryError
        If the file cannot be read.
    """
    return read_files([source])[0]


def read_files(sources: Sequence[str]) -> list[ImportedMesh]:
    """:func:`read_file` of several files.

    Raises
    ------
    GeometryError
        If one of them cannot be read.
    """
    of_vtk = [source for source in sources if Path(source).suffix.lower() != ".msh"]
    grids = dict(zip(of_vtk, read_grids(of_vtk), strict=True)) if of_vtk else {}
    return [_of_grid(source, grids[source]) if source in grids else _read_gmsh(source) for source in sources]


def _unreadable(source: str, reason: str) -> GeometryError:
    return GeometryError(f"{source}: cannot be read as {Path(source).suffix.lower()} ({reason}): write the file again")


def _of_grid(source: str, grid: Any) -> ImportedMesh:
    """The mesh of an unstructured grid of PyVista, or of the reason why there is none."""
    if isinstance(grid, str):
        raise _unreadable(source, grid)
    grid = _of_fixed_order(grid)
    types = {int(number): _VTK_TYPES.get(int(number), f"VTK cell {number}") for number in np.unique(grid.celltypes)}
    others = sorted(set(types.values()) - {*_TETRAHEDRA, *_TRIANGLES, *_IGNORED_TYPES})
    if others:
        kinds_found = ", ".join(others[:3]) + (", ..." if len(others) > 3 else "")
        raise GeometryError(f"{source}: holds cells of the kind {kinds_found}: split them into tetrahedra")
    kinds = [[number for number, name in types.items() if name in names] for names in (_TETRAHEDRA, _TRIANGLES)]
    if len(kinds[0]) > 1:
        raise GeometryError(f"{source}: holds linear and quadratic tetrahedra: write all of them in one order")
    tetrahedra = [grid.cells_dict[number] for number in kinds[0]] or [np.empty((0, 4))]
    triangles = [grid.cells_dict[number][:, :3] for number in kinds[1]] or [np.empty((0, 3))]
    arrays = {name: np.asarray(grid.cell_data[name]) for name in grid.cell_data}
    of_cells, of_triangles = (
        {name: _of_types(grid, values, some) for name, values in arrays.items() if some} for some in kinds
    )
    return ImportedMesh(
        source,
        np.asarray(grid.points, dtype=float),
        np.concatenate(tetrahedra).astype(np.int32),
        np.concatenate(triangles).astype(np.int32),
        of_cells,
        of_triangles,
        {name: np.asarray(grid.point_data[name]) for name in grid.point_data},
    )


def _of_types(grid: Any, values: NDArray, types: list[int]) -> NDArray:
    """Values at the cells of some types, one type after the other, of those at all cells."""
    return np.concatenate([values[grid.celltypes == number] for number in types])


def _of_fixed_order(grid: Any) -> Any:
    """The grid with linear and quadratic Lagrange triangles and tetrahedra as such; their nodes are in one order."""
    import pyvista

    if not np.isin(grid.celltypes, [kind for kind, _ in _LAGRANGE]).any():
        return grid
    sizes = np.diff(pyvista.convert_array(grid.GetCells().GetOffsetsArray()))
    types = [_LAGRANGE.get((int(t), int(n)), int(t)) for t, n in zip(grid.celltypes, sizes, strict=True)]
    found = pyvista.UnstructuredGrid(grid.cells, np.array(types, np.uint8), grid.points)
    found.cell_data.update(dict(grid.cell_data))
    found.point_data.update(dict(grid.point_data))
    return found


def _read_gmsh(source: str) -> ImportedMesh:
    import pyvista
    from meshio import gmsh

    try:
        mesh = gmsh.read(source)
        grid = pyvista.from_meshio(mesh)
    except Exception as error:  # the library does not document what it raises
        reason = (str(error).splitlines() or ["it does not begin as one"])[0].rstrip(".")
        raise _unreadable(source, reason) from None
    groups = {name: int(number) for name, (number, _) in mesh.field_data.items()}
    return replace(_of_grid(source, grid), physical_groups=groups)


def merge_points(mesh: ImportedMesh) -> ImportedMesh:
    """The mesh with coincident points merged and points without a cell left out."""
    size = np.ptp(mesh.nodes, axis=0).max()
    if not size > 0:
        raise GeometryError(f"{mesh.source}: all its points coincide: write the file again")
    # Files of single precision repeat a point to seven digits.
    rounded = np.round(mesh.nodes / (1e-6 * size)).astype(np.int64)
    _, first, number = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    number = number.ravel()
    used = np.unique(np.concatenate([number[mesh.cells].ravel(), number[mesh.triangles].ravel()]))
    new = np.full(len(first), -1, dtype=np.int32)
    new[used] = np.arange(len(used))
    return replace(
        mesh,
        nodes=mesh.nodes[first[used]],
        cells=new[number[mesh.cells]],
        triangles=new[number[mesh.triangles]],
        node_arrays={name: values[first[used]] for name, values in mesh.node_arrays.items()},
    )

"""What a file of a heart holds: tetrahedra or a closed surface, and the arrays over them."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Floats, Integers
from echotruth.mechanics.geometry.mesh_quality import GeometryError

Arrays = dict[str, NDArray]

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
SOLIDS, SURFACES = (".vtu", ".vtk", ".msh"), (".stl", ".ply", ".vtp")

_TETRAHEDRA = {"tetra": 4, "tetra10": 10}
_TRIANGLES = ("triangle", "triangle6")
_FLAT = (*_TRIANGLES, "vertex", "line", "line3", "polygon", "quad", "quad8", "quad9")
"""Cells without a volume, which a file of tetrahedra may hold beside them."""


@dataclass(frozen=True)
class Body:
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
    names : dict
        Name of a physical group to its number.
    """

    source: str
    nodes: Floats
    cells: Integers
    triangles: Integers
    cell_arrays: Arrays = field(default_factory=dict)
    triangle_arrays: Arrays = field(default_factory=dict)
    node_arrays: Arrays = field(default_factory=dict)
    names: dict[str, int] = field(default_factory=dict)


def read(geometry: Geometry) -> Body:
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
    kinds = f"tetrahedra as {', '.join(SOLIDS)}, or a closed surface of the wall as {', '.join(SURFACES)}"
    if suffix not in (*SOLIDS, *SURFACES):
        raise GeometryError(f"{source}: geometry.file ends in {suffix or 'no suffix'}: give {kinds}")
    if not Path(source).is_file():
        raise GeometryError(f"{source}: geometry.file is not there: give its path, as seen from where echotruth runs")
    body = _body(source, suffix)
    if not len(body.cells) and (suffix in SOLIDS or not len(body.triangles)):
        wanted = "tetrahedra" if suffix in SOLIDS else "triangles"
        raise GeometryError(f"{source}: holds no {wanted}: give {kinds}")
    if not np.isfinite(body.nodes).all():
        raise GeometryError(f"{source}: holds points that are not finite numbers: mend the file")
    return _merged(replace(body, nodes=body.nodes * METRES[geometry.unit] * geometry.scale))


def fingerprint(geometry: Geometry) -> str:
    """Hash of the file's content, or an empty string where there is none: a changed file is a changed heart."""
    path = Path(geometry.file) if geometry.file else None
    return sha256(path.read_bytes()).hexdigest()[:16] if path and path.is_file() else ""


def _body(source: str, suffix: str) -> Body:
    try:
        body = _of_gmsh(source) if suffix == ".msh" else _of_vtk(source)
    except GeometryError:
        raise
    except Exception as error:  # what a foreign reader may raise is not known
        reason = (str(error).splitlines() or ["it does not begin as one"])[0].rstrip(".")
        raise GeometryError(f"{source}: cannot be read as {suffix} ({reason}): write the file anew") from None
    if body is None:
        raise GeometryError(f"{source}: is empty or cannot be read as {suffix}: write the file anew")
    return body


def _of_vtk(source: str) -> Body | None:
    import pyvista

    grid = _quietly_read(source)
    if not isinstance(grid, pyvista.DataSet) or not grid.n_cells:
        return None
    if isinstance(grid, pyvista.PolyData):
        grid = grid.triangulate()
    grid = grid.cast_to_unstructured_grid()
    kinds = {int(kind): _KIND_OF_VTK.get(int(kind), f"VTK cell {kind}") for kind in np.unique(grid.celltypes)}
    blocks = [(name, grid.cells_dict[kind], grid.celltypes == kind) for kind, name in kinds.items() if name in _OURS]
    _refuse_others(source, kinds.values())
    return Body(
        source,
        np.asarray(grid.points, dtype=float),
        *_cells(source, [(name, cells) for name, cells, _ in blocks]),
        *_split({name: np.asarray(grid.cell_data[name]) for name in grid.cell_data}, blocks),
        {name: np.asarray(grid.point_data[name]) for name in grid.point_data},
    )


def _quietly_read(source: str) -> Any:
    """What VTK reads, its complaints raised in place of printed."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    verbosity, disabled = vtkLogger.GetCurrentVerbosityCutoff(), logging.root.manager.disable
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings(), pyvista.VtkErrorCatcher(send_to_logging=False) as errors:
            warnings.simplefilter("ignore")
            grid = pyvista.read(source)
    finally:
        vtkLogger.SetStderrVerbosity(verbosity)
        logging.disable(disabled)
    if errors.events:
        raise ValueError(errors.events[0].alert)
    return grid


def _of_gmsh(source: str) -> Body:
    from meshio import gmsh

    mesh = gmsh.read(source)
    _refuse_others(source, [block.type for block in mesh.cells])
    blocks = [(block.type, block.data) for block in mesh.cells]
    arrays: tuple[Arrays, Arrays] = {}, {}
    for into, wanted in zip(arrays, (tuple(_TETRAHEDRA), _TRIANGLES), strict=True):
        for name, values in mesh.cell_data.items():
            chosen = [value for value, (kind, _) in zip(values, blocks, strict=True) if kind in wanted]
            if chosen:
                into[name] = np.concatenate(chosen)
    names = {name: int(number) for name, (number, _) in mesh.field_data.items()}
    nodes = np.asarray(mesh.points, dtype=float)
    return Body(source, nodes, *_cells(source, blocks), *arrays, dict(mesh.point_data), names)


_KIND_OF_VTK = {
    **{
        1: "vertex",
        2: "vertex",
        3: "line",
        4: "line",
        5: "triangle",
        7: "polygon",
        9: "quad",
        10: "tetra",
        11: "voxel",
    },
    **{12: "hexahedron", 13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10"},
}
_OURS = (*_TETRAHEDRA, *_TRIANGLES)


def _refuse_others(source: str, kinds: Iterable[str]) -> None:
    others = sorted({kind for kind in kinds if kind not in (*_OURS, *_FLAT)})
    if others:
        raise GeometryError(f"{source}: holds cells of the kind {', '.join(others)}: split them into tetrahedra")


def _cells(source: str, blocks: list[tuple[str, NDArray]]) -> tuple[Integers, Integers]:
    """Tetrahedra and (straight) triangles."""
    solid = [cells for name, cells in blocks if name in _TETRAHEDRA]
    flat = [cells[:, :3] for name, cells in blocks if name in _TRIANGLES]
    if len({cells.shape[1] for cells in solid}) > 1:
        raise GeometryError(f"{source}: holds linear and quadratic tetrahedra: write all of them in one order")
    cells = np.concatenate(solid) if solid else np.empty((0, 4))
    return cells.astype(np.int32), (np.concatenate(flat) if flat else np.empty((0, 3))).astype(np.int32)


def _split(arrays: Arrays, blocks: list[tuple[str, NDArray, NDArray]]) -> tuple[Arrays, Arrays]:
    """Values at the tetrahedra and at the triangles."""
    found: list[Arrays] = []
    for wanted in (tuple(_TETRAHEDRA), _TRIANGLES):
        masks = [mask for name, _, mask in blocks if name in wanted]
        found.append({name: np.concatenate([v[m] for m in masks]) for name, v in arrays.items() if masks})
    return found[0], found[1]


def _merged(body: Body) -> Body:
    """Points written once for every cell made one, points without a cell left out."""
    size = np.ptp(body.nodes, axis=0).max()
    if not size > 0:
        raise GeometryError(f"{body.source}: all its points lie in one place: write the file anew")
    # Files of single precision repeat a point to seven digits.
    place = np.round(body.nodes / (1e-6 * size)).astype(np.int64)
    _, first, number = np.unique(place, axis=0, return_index=True, return_inverse=True)
    number = number.ravel()
    used = np.unique(np.concatenate([number[body.cells].ravel(), number[body.triangles].ravel()]))
    new = np.full(len(first), -1, dtype=np.int32)
    new[used] = np.arange(len(used))
    return replace(
        body,
        nodes=body.nodes[first[used]],
        cells=new[number[body.cells]],
        triangles=new[number[body.triangles]],
        node_arrays={name: values[first[used]] for name, values in body.node_arrays.items()},
    )

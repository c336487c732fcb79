"""Reading a file by VTK in a process of its own, which this module is when it is run.

VTK's readers trust the sizes and indices of a file: a wrong one can end the process that reads it.
"""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

LONGEST_S = 600
"""Time after which a reader is given up: a damaged file can also make it wait for ever."""

_SIZES = {5: 3, 10: 4, 22: 6, 24: 10}
"""Type of VTK -> number of points: linear and quadratic triangles and tetrahedra."""


def read_grids(sources: Sequence[str]) -> list[Any]:
    """Unstructured grids of files, polygons as triangles.

    Parameters
    ----------
    sources : sequence of str

    Returns
    -------
    list of pyvista.UnstructuredGrid or str
        Of a file that cannot be read, the reason.
    """
    import pyvista

    with tempfile.TemporaryDirectory() as folder:
        targets = [str(Path(folder) / f"{number}.vtu") for number in range(len(sources))]
        # With -P the modules beside this one do not stand in for others of their name.
        command = [sys.executable, "-P", __file__, folder]
        streams: dict[str, Any] = {"input": "\n".join(sources), "capture_output": True, "text": True}
        try:
            subprocess.run(command, **streams, timeout=LONGEST_S, check=False)
            ended = "its sizes or indices are wrong, the reader ends on them"
        except subprocess.TimeoutExpired:
            ended = f"its sizes or indices are wrong, the reader does not end within {LONGEST_S} s"
        return [pyvista.read(target) if Path(target).is_file() else _reason(target, ended) for target in targets]


def _reason(target: str, otherwise: str) -> str:
    reason = Path(f"{target}.txt")
    return reason.read_text(encoding="utf-8") if reason.is_file() else otherwise


def bad_cell(connectivity: Any, offsets: Any, types: Any, n_points: int) -> str:
    """What is wrong with the first cell that cannot be; empty if there is none.

    Parameters
    ----------
    connectivity : ndarray of shape (n,)
        Points of all cells, one cell after the other.
    offsets : ndarray of shape (n_cells + 1,)
        Where each cell begins in it.
    types : ndarray of shape (n_cells,)
        Those of VTK.
    n_points : int
    """
    outside = np.flatnonzero((connectivity < 0) | (connectivity >= n_points))
    if len(outside):
        cell = np.searchsorted(offsets, outside[0], "right") - 1
        return f"cell {cell} names the point {connectivity[outside[0]]}, and its points are 0 to {n_points - 1}"
    expected = np.array([_SIZES.get(int(kind), 0) for kind in range(256)])[types]
    wrong = np.flatnonzero((expected > 0) & (np.diff(offsets) != expected))
    if len(wrong):
        cell = wrong[0]
        return f"cell {cell} has {offsets[cell + 1] - offsets[cell]} points and must have {expected[cell]}"
    return ""


def _copy(source: str, target: Path) -> None:
    """Write what a file holds as an unstructured grid, or, to a text beside it, why that cannot be."""
    try:
        grid = _read(source)
    except Exception as error:  # the library does not document what it raises
        reason = (str(error).splitlines() or ["it does not begin as one"])[0].rstrip(".")
        Path(f"{target}.txt").write_text(reason, encoding="utf-8")
    else:
        # The file gets its name when it is whole.
        part = target.with_suffix(".part.vtu")
        grid.save(part)
        part.rename(target)


def _read(source: str) -> Any:
    import pyvista

    with pyvista.VtkErrorCatcher(send_to_logging=False) as errors:
        grid = pyvista.read(source)
    if errors.events:
        raise ValueError(errors.events[0].alert)
    if not isinstance(grid, pyvista.DataSet) or not grid.n_cells:
        raise ValueError("it is empty or holds no whole mesh")
    cells = grid.cast_to_unstructured_grid()
    if wrong := bad_cell(cells.cell_connectivity, cells.offset, cells.celltypes, cells.n_points):
        raise ValueError(wrong)
    return grid.triangulate().cast_to_unstructured_grid() if isinstance(grid, pyvista.PolyData) else cells


if __name__ == "__main__":
    for number, line in enumerate(sys.stdin.read().split("\n")):
        _copy(line, Path(sys.argv[1]) / f"{number}.vtu")

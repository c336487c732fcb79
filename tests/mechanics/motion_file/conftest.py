"""A heart that moves by an affine map, as other programs would write it: rotated, shifted, in millimetres."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from affine_motion import FRAMES, SHIFT, TRANSLATION, TURN, amplitude, gradient

from echotruth.config import Config, Geometry
from echotruth.fem.tetrahedra import Integers
from echotruth.mechanics.geometry import left_ventricle


def linear(cells: Integers) -> tuple[Integers, Integers]:
    """Linear tetrahedra between the vertices of quadratic ones, and the nodes that they use."""
    used, number = np.unique(cells[:, :4], return_inverse=True)
    return number.reshape(-1, 4).astype(np.int32), used


@pytest.fixture(scope="session")
def affine_heart():
    """Nodes, m, in the heart frame, and cells, both linear and quadratic, and positions in the files over time."""
    mesh = left_ventricle(Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1))
    cells, used = linear(mesh.cells)

    def positions(order, phases):
        nodes = mesh.nodes if order == 2 else mesh.nodes[used]
        moved = [1e3 * nodes @ gradient(a).T + a * TRANSLATION for a in amplitude(phases)]
        return np.stack(moved) @ TURN + SHIFT

    by_order = {1: (mesh.nodes[used], cells), 2: (mesh.nodes, mesh.cells)}
    return SimpleNamespace(of_order=by_order, positions=positions)


def _grid(nodes, cells, lagrange=False):
    import pyvista

    kind = {4: 10, 10: 24}[cells.shape[1]]
    found = pyvista.UnstructuredGrid({kind: cells.astype(np.int64)}, nodes)
    return pyvista.UnstructuredGrid(found.cells, np.full(len(cells), 71, np.uint8), nodes) if lagrange else found


def _vtk(folder, positions, cells, suffix="vtk"):
    for i, nodes in enumerate(positions):
        _grid(nodes, cells).save(folder / f"frame_{i}.{suffix}", binary=i % 2 == 0)
    return {"path": str(folder / f"frame_*.{suffix}")}


def _pvtu(folder, positions, cells):
    """In two pieces, as of two processes: points between them are in both."""
    halves = cells[: len(cells) // 2], cells[len(cells) // 2 :]
    for i, nodes in enumerate(positions):
        names = [f"frame_{i}_p{k}.vtu" for k in range(2)]
        for name, half in zip(names, halves, strict=True):
            used, number = np.unique(half, return_inverse=True)
            _grid(nodes[used], number.reshape(half.shape)).save(folder / name)
        pieces = "".join(f'<Piece Source="{name}"/>' for name in names)
        points = '<PPoints><PDataArray type="Float64" Name="Points" NumberOfComponents="3"/></PPoints>'
        text = f"<PUnstructuredGrid>{points}{pieces}</PUnstructuredGrid>"
        (folder / f"frame_{i}.pvtu").write_text(f'<VTKFile type="PUnstructuredGrid" version="1.0">{text}</VTKFile>')
    return {"path": str(folder / "frame_*.pvtu")}


def _pvd(folder, positions, cells, times=None):
    """As DOLFINx writes it: Lagrange tetrahedra at rest, and the displacement over their points."""
    times, entries = 0.01 * np.arange(len(positions)) if times is None else times, []
    for i, nodes in enumerate(positions):
        frame = _grid(positions[0], cells, lagrange=True)
        frame.point_data["u"] = nodes - positions[0]
        frame.save(folder / f"heart_p0_{i:06d}.vtu")
        entries.append(f'<DataSet timestep="{times[i]:.6g}" part="0" file="heart_p0_{i:06d}.vtu" />')
    text = f'<VTKFile type="Collection" version="1.0"><Collection>{"".join(entries)}</Collection></VTKFile>'
    (folder / "heart.pvd").write_text(text)
    return {"path": str(folder / "heart.pvd"), "displacement": "u"}


def _xdmf(folder, positions, cells):
    """As meshio writes it, of linear tetrahedra."""
    from meshio.xdmf import TimeSeriesWriter

    with TimeSeriesWriter(folder / "heart.xdmf", "XML") as writer:
        writer.write_points_cells(positions[0], [("tetra", cells)])
        for i, nodes in enumerate(positions):
            writer.write_data(0.01 * i, point_data={"pressure": nodes[:, 0], "u": nodes - positions[0]})


def _npy(folder, positions, cells):
    _grid(positions[0], cells).save(folder / "mesh.vtu")
    np.save(folder / "positions.npy", positions)
    return {"path": str(folder / "positions.npy")}


def _npz(folder, positions, cells):
    _grid(positions[0], cells).save(folder / "mesh.vtu")
    np.savez(folder / "motion.npz", u=positions - positions[0], times=np.arange(len(positions)))
    return {"path": str(folder / "motion.npz"), "displacement": "u"}


WRITERS = {"vtk": _vtk, "vtu": partial(_vtk, suffix="vtu"), "pvd": _pvd, "pvtu": _pvtu, "npy": _npy, "npz": _npz}
WRITERS["xdmf"] = _xdmf


@pytest.fixture
def write_series(tmp_path, monkeypatch, read_here):
    """Write frames of positions (n_frames, n, 3) of tetrahedra in a format; return the section `motion.file`."""
    monkeypatch.chdir(tmp_path)
    return lambda name, *arguments, **keys: WRITERS[name](tmp_path, *arguments, **keys)


@pytest.fixture
def configured(tmp_path):
    """Configuration of a section `motion.file`, with the axes of the affine heart."""

    def configure(section, frames=FRAMES, **geometry):
        point = (np.array([1.0, 0, 0]) @ TURN + SHIFT).tolist()
        mesh = {"file": str(tmp_path / "mesh.vtu")} if section["path"].endswith(("npy", "npz")) else {}
        return Config(
            geometry=mesh | {"septum_point": point} | geometry,
            motion={"kind": "file", "file": section},
            loop={"frames": frames, "heart_rate_per_min": 500.0},
        )

    return configure

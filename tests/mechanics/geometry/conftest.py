"""Files of a known heart: an ellipsoid, rotated and shifted, as other programs would write it."""

from types import SimpleNamespace

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
"""Rows: the axes of the heart in the coordinates of the files."""
SHIFT = np.array([12.0, -7.0, 30.0])
"""Origin of the heart in the coordinates of the files, mm."""


@pytest.fixture(scope="session")
def file_heart():
    """Mesh of the mouse's ellipsoid, and its nodes (n, 3) in the coordinates of the files, mm."""
    mesh = left_ventricle(Geometry(circumferential_elements=18, longitudinal_elements=8, transmural_elements=2))
    return SimpleNamespace(mesh=mesh, nodes=1e3 * mesh.nodes @ TURN + SHIFT, turn=TURN, shift=SHIFT)


@pytest.fixture
def write_mesh(tmp_path, read_here):
    """Write tetrahedra, with arrays over them, to a .vtu and return its path."""
    import pyvista

    def write(nodes, cells, name="heart.vtu", **arrays):
        grid = pyvista.UnstructuredGrid({24 if cells.shape[1] == 10 else 10: cells.astype(np.int64)}, nodes)
        for key, values in arrays.items():
            grid.cell_data[key] = values
        grid.save(tmp_path / name)
        return str(tmp_path / name)

    return write


@pytest.fixture
def write_surface(tmp_path, read_here):
    """Write triangles to an .stl and return its path."""
    import pyvista

    def write(nodes, triangles, name="wall.stl"):
        pyvista.PolyData.from_regular_faces(nodes, triangles[:, :3].astype(np.int64)).save(tmp_path / name)
        return str(tmp_path / name)

    return write

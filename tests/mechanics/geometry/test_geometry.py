"""One entry for every heart: the ellipsoid and the file."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.cavity import cavity_volume


def test_ellipsoid_and_file_are_the_same_heart(file_heart, write_mesh):
    file = write_mesh(file_heart.nodes, file_heart.mesh.cells)
    septum = (file_heart.nodes[0] + file_heart.turn[0] * 5).tolist()
    found = left_ventricle(Geometry(file=file, septum_point=septum))
    np.testing.assert_allclose(np.sort(found.nodes, axis=0), np.sort(file_heart.mesh.nodes, axis=0), atol=1e-8)
    assert cavity_volume(found.nodes, found.endo) == pytest.approx(
        cavity_volume(file_heart.mesh.nodes, file_heart.mesh.endo)
    )

"""Which displacements of the base are free."""

import numpy as np

from echotruth.config import Geometry
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.support import base_support

HEMISPHERE = Geometry(
    endo_radius_mm=2.0,
    endo_length_mm=2.0,
    wall_mm=1.0,
    apex_wall_mm=1.0,
    base_mm=0.0,
    circumferential_elements=24,
    longitudinal_elements=8,
    transmural_elements=1,
)


def test_base_moves_along_its_radius_alone_or_not_at_all():
    mesh = left_ventricle(HEMISPHERE)
    rim = np.unique(mesh.base)
    free, fixed, elastic = (base_support(mesh, base) for base in ("radial_free", "fixed", "elastic"))
    assert free.free.sum() == fixed.free.sum() + len(rim)
    assert elastic.free.all()
    np.testing.assert_allclose(np.cross(free.directions[rim, 0], mesh.nodes[rim]), 0, atol=1e-12)
    assert free.free[rim].tolist() == [[True, False, False]] * len(rim)

"""Which displacements of the base are free."""

import numpy as np

from echotruth.mechanics.solver.support import base_support


def test_base_moves_along_its_radius_alone_or_not_at_all(half_sphere):
    rim = np.unique(half_sphere.base)
    free, fixed, elastic = (base_support(half_sphere, base) for base in ("radial_free", "fixed", "elastic"))
    assert free.free.sum() == fixed.free.sum() + len(rim)
    assert elastic.free.all()
    np.testing.assert_allclose(np.cross(free.directions[rim, 0], half_sphere.nodes[rim]), 0, atol=1e-12)
    assert free.free[rim].tolist() == [[True, False, False]] * len(rim)

"""Direct solvers on an indefinite matrix."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from echotruth.mechanics.sparse import SuperLU, factorization


@pytest.mark.parametrize("make", [factorization, SuperLU])
def test_indefinite_systems_of_one_pattern_are_solved(make):
    rng = np.random.default_rng(0)
    solver = make()
    for _ in range(2):
        matrix = rng.normal(size=(40, 40))
        matrix = matrix + matrix.T + np.diag(10 * rng.choice([-1.0, 1.0], 40))
        right = rng.normal(size=(40, 2))
        solver.factor(csr_matrix(triu(matrix)))
        np.testing.assert_allclose(matrix @ solver.solve(right), right, atol=1e-9)
    solver.close()

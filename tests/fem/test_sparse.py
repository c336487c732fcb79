"""Direct solvers on an indefinite matrix."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from echotruth.fem.sparse import SINGLE_TOLERANCE, Pardiso, SuperLU, factorization


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


def test_factors_of_single_precision_leave_a_small_residual_or_give_way_to_double():
    pytest.importorskip("pypardiso")
    rng = np.random.default_rng(1)
    turn = np.linalg.qr(rng.normal(size=(60, 60)))[0]
    right, solver = rng.normal(size=(60, 1)), Pardiso(single=True)
    for spread, bound in ((4, SINGLE_TOLERANCE), (10, 1e-4)):
        matrix = turn * np.logspace(0, spread, 60) @ turn.T
        solver.factor(csr_matrix(triu((matrix + matrix.T) / 2)))
        residual = matrix @ solver.solve(right) - right
        assert np.linalg.norm(residual) <= bound * np.linalg.norm(right), f"condition 1e{spread}"
    solver.close()


@pytest.mark.parametrize("single", [True, False])
def test_solution_does_not_depend_on_where_in_memory_its_input_begins(single):
    pytest.importorskip("pypardiso")
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(300, 300))
    upper, right = triu(matrix + matrix.T, format="csr"), rng.normal(size=(300, 2))
    solver, solutions = Pardiso(single), set()
    for shift in range(0, 64, 8):
        memory = np.empty(upper.nnz + 16)
        values = memory[shift // 8 : shift // 8 + upper.nnz]
        values[:] = upper.data
        solver.factor(csr_matrix((values, upper.indices, upper.indptr)))
        solutions.add(solver.solve(right).tobytes())
    solver.close()
    assert len(solutions) == 1

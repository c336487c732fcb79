"""Direct solution of symmetric sparse systems, behind one small interface.

MKL Pardiso factors A = L D L^T without regard to the signs of D (the tangent of an
active wall is indefinite); where it is missing, SuperLU does, several times slower.
Both run on one thread: sums in another order would change the last bytes of the result.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix, diags, triu

Floats = NDArray[np.float64]

_SYMMETRIC_INDEFINITE = -2
_ANALYSE, _FACTOR, _SOLVE = 11, 22, 33

_PARAMETERS = {1: 1, 2: 2, 8: 0, 10: 8, 21: 1}
"""Pardiso's iparm: own values, nested dissection, no iterative refinement (Newton's method does that),
pivots raised to 1e-8, Bunch-Kaufman pivoting."""


class SingularMatrix(ArithmeticError):
    """A matrix that could not be factored."""


class Factorization(Protocol):
    """Factors of symmetric matrices that share one pattern."""

    def factor(self, upper: csr_matrix) -> None:
        """Factor the matrix whose upper triangle is given, every diagonal entry present."""

    def solve(self, right: Floats) -> Floats:
        """Solutions, shape (n, n_right), for right-hand sides of that shape."""

    def close(self) -> None:
        """Give the memory back."""


def factorization() -> Factorization:
    """The fastest direct solver at hand.

    Returns
    -------
    Factorization
        Pardiso if `pypardiso` and MKL can be loaded, otherwise SuperLU.
    """
    try:
        return Pardiso()
    except (ImportError, OSError):
        return SuperLU()


class Pardiso:
    """L D L^T by MKL Pardiso; the symbolic analysis of the first matrix serves all."""

    def __init__(self) -> None:
        from pypardiso import PyPardisoSolver

        self._solver = PyPardisoSolver(mtype=_SYMMETRIC_INDEFINITE)
        for place, value in _PARAMETERS.items():
            self._solver.set_iparm(place, value)
        self._upper: csr_matrix | None = None

    def factor(self, upper: csr_matrix) -> None:
        """Factor the matrix whose upper triangle is given, every diagonal entry present."""
        first = self._upper is None
        self._upper = upper
        nothing = np.zeros((upper.shape[0], 1))
        if first:
            self._call(_ANALYSE, nothing)
        self._call(_FACTOR, nothing)

    def solve(self, right: Floats) -> Floats:
        """Solutions, shape (n, n_right), for right-hand sides of that shape."""
        return self._call(_SOLVE, np.asfortranarray(right))

    def close(self) -> None:
        """Give the memory back."""
        if self._upper is not None:
            self._solver.free_memory(everything=True)
            self._upper = None

    def _call(self, phase: int, right: Floats) -> Floats:
        from pypardiso.pardiso_wrapper import PyPardisoError

        self._solver.libmkl.MKL_Set_Num_Threads(1)
        self._solver.set_phase(phase)
        try:
            # The public methods analyse every matrix anew, although the pattern stays.
            return self._solver._call_pardiso(self._upper, right)
        except PyPardisoError as error:
            raise SingularMatrix(f"MKL Pardiso could not factor the matrix ({error}).") from None


class SuperLU:
    """L U by SciPy's SuperLU."""

    def factor(self, upper: csr_matrix) -> None:
        """Factor the matrix whose upper triangle is given, every diagonal entry present."""
        from scipy.sparse.linalg import splu

        whole = csc_matrix(upper + triu(upper, 1).T)
        # Equal scales of rows and columns stand in for the pivoting that symmetric ordering leaves out.
        self._scale = 1 / np.sqrt(np.abs(whole.diagonal()))
        scaled = (diags(self._scale) @ whole @ diags(self._scale)).tocsc()
        options = {"SymmetricMode": True}
        try:
            self._factors = splu(scaled, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options=options)
        except RuntimeError as error:
            raise SingularMatrix(f"SuperLU could not factor the matrix ({error}).") from None

    def solve(self, right: Floats) -> Floats:
        """Solutions, shape (n, n_right), for right-hand sides of that shape."""
        return self._scale[:, None] * self._factors.solve(self._scale[:, None] * right)

    def close(self) -> None:
        """Give the memory back."""
        self._factors = None

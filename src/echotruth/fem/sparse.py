"""Direct solution of symmetric sparse systems, by two classes of the same methods.

MKL Pardiso factors A = L D L^T without regard to the signs of D (the tangent of an
active wall is indefinite); where it is missing, SuperLU takes its place, several times slower.
Both run on one thread: sums in another order would change the last bytes of the result.
"""

from __future__ import annotations

import os
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix, diags, triu

from echotruth.arrays import Floats

_SYMMETRIC_INDEFINITE = -2
_ANALYSE, _FACTOR, _SOLVE = 11, 22, 33

_PARAMETERS = {1: 1, 2: 2, 8: 0, 10: 8, 21: 1}
"""Pardiso's iparm: not its defaults, nested dissection, no iterative refinement (Newton's method does that),
pivots raised to 1e-8, Bunch-Kaufman pivoting."""

_PRECISIONS: dict[type, dict[int, int]] = {np.float64: {28: 0}, np.float32: {28: 1}}
"""Pardiso's iparm for the precision of the factors."""

SINGLE_TOLERANCE = 2e-2
"""Residual over right-hand side at which the refinement of a solution with factors of single precision stops: it is a
Newton correction, and the next one makes up for the rest."""

_MAX_REFINEMENTS = 5

_CBWR_AUTO, _CBWR_AVX2 = 2, 10
"""MKL's constants for sums in one order (conditional numerical reproducibility): on one kind of processor, and on all
those of Intel with AVX2. Other makes have the first alone; the code that runs on all takes twice the time."""
_ALIGNMENT = 64
"""Bytes at whose multiples arrays must begin for that: elsewhere MKL splits its loops, and rounds, differently."""


class SingularMatrix(ArithmeticError):
    """Raised if a matrix cannot be factored."""


def factorization(single: bool = False) -> Pardiso | SuperLU:
    """The fastest direct solver available.

    Parameters
    ----------
    single : bool
        Whether factors in single precision suffice.

    Returns
    -------
    Pardiso or SuperLU
        Pardiso if `pypardiso` and MKL can be loaded, otherwise SuperLU.
    """
    try:
        return Pardiso(single)
    except (ImportError, OSError):
        return SuperLU()


class Pardiso:
    """L D L^T by MKL Pardiso; the symbolic analysis of the first matrix serves all.

    Parameters
    ----------
    single : bool
        Factor in single precision, in two thirds of the time; solutions are refined in double precision until
        |b - A x| <= `SINGLE_TOLERANCE` |b|. A matrix for which that fails is factored again in double precision.
    """

    def __init__(self, single: bool = False) -> None:
        _set_mkl_path()
        from pypardiso import PyPardisoSolver

        self._solvers = {precision: PyPardisoSolver(mtype=_SYMMETRIC_INDEFINITE) for precision in _PRECISIONS}
        mkl = self._solvers[np.float64].libmkl
        if mkl.MKL_CBWR_Set(_CBWR_AVX2):  # not zero: the processor has no such branch
            mkl.MKL_CBWR_Set(_CBWR_AUTO)
        for precision, solver in self._solvers.items():
            for index, value in (_PARAMETERS | _PRECISIONS[precision]).items():
                solver.set_iparm(index, value)
        self._first_precision = np.float32 if single else np.float64
        self._analysed: set[type] = set()

    def factor(self, upper: csr_matrix) -> None:
        """Factor the matrix whose upper triangle is given, every diagonal entry present."""
        self._upper, self._diagonal = upper, upper.diagonal()
        self._factor(self._first_precision)

    def solve(self, right: Floats) -> Floats:
        """Solutions, shape (n, n_right), for right-hand sides of that shape."""
        solution = self._solution(right)
        if self._precision is np.float64:
            return solution
        residual, size = right - self._times(solution), _norm(right)
        for _ in range(_MAX_REFINEMENTS):
            if _norm(residual) <= SINGLE_TOLERANCE * size:
                return solution
            solution = solution + self._solution(residual)
            residual = right - self._times(solution)
        self._factor(np.float64)
        return self._solution(right)

    def close(self) -> None:
        """Free the memory."""
        for precision in self._analysed:
            self._solvers[precision].free_memory(everything=True)
        self._analysed = set()

    # A matrix that overflows in single precision gives no solution, and is factored again in double.
    @np.errstate(over="ignore")
    def _factor(self, precision: type) -> None:
        self._precision = precision
        values = _aligned(self._upper.data, precision)
        self._values = csr_matrix((values, self._upper.indices, self._upper.indptr), self._upper.shape)
        unused = np.zeros((self._upper.shape[0], 1))
        if precision not in self._analysed:
            self._call(_ANALYSE, unused)
            self._analysed.add(precision)
        self._call(_FACTOR, unused)

    def _solution(self, right: Floats) -> Floats:
        size = float(np.abs(right).max()) or 1.0  # scaled, so that no right-hand side overflows in single precision
        return size * self._call(_SOLVE, right / size).astype(np.float64)

    def _times(self, vector: Floats) -> Floats:
        """The symmetric matrix times vectors."""
        return self._upper @ vector + self._upper.T @ vector - self._diagonal[:, None] * vector

    def _call(self, phase: int, right: Floats) -> Floats:
        from pypardiso.pardiso_wrapper import PyPardisoError

        solver = self._solvers[self._precision]
        solver.libmkl.MKL_Set_Num_Threads(1)
        solver.set_phase(phase)
        try:
            # The public methods analyse every matrix again, although the pattern stays.
            return solver._call_pardiso(self._values, _aligned(right, self._precision))
        except PyPardisoError as error:
            raise SingularMatrix(f"MKL Pardiso could not factor the matrix ({error}).") from None


def _set_mkl_path() -> None:
    """Set the path of MKL for pypardiso, which would search all folders of the environment for each solver."""
    try:
        libraries = [str(file.locate()) for file in files("mkl") or [] if "mkl_rt" in file.name]
    except PackageNotFoundError:
        return
    for path in filter(os.path.exists, libraries):
        os.environ.setdefault("PYPARDISO_MKL_RT", path)


def _aligned(values: Floats, precision: type) -> NDArray[Any]:
    """A copy in Fortran order that begins at a multiple of `_ALIGNMENT` bytes."""
    size = values.size * np.dtype(precision).itemsize
    memory = np.empty(size + _ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % _ALIGNMENT
    copy: NDArray[Any] = memory[start : start + size].view(precision).reshape(values.shape, order="F")
    copy[...] = values
    return copy


def _norm(vectors: Floats) -> float:
    return float(np.sqrt(np.sum(vectors**2)))  # not by BLAS, whose sums depend on its threads


class SuperLU:
    """L U by SciPy's SuperLU."""

    def factor(self, upper: csr_matrix) -> None:
        """Factor the matrix whose upper triangle is given, every diagonal entry present."""
        from scipy.sparse.linalg import splu

        full = csc_matrix(upper + triu(upper, 1).T)
        # Scaling rows and columns alike replaces the pivoting that symmetric ordering leaves out.
        self._scale = 1 / np.sqrt(np.abs(full.diagonal()))
        scaled = (diags(self._scale) @ full @ diags(self._scale)).tocsc()
        options = {"SymmetricMode": True}
        try:
            self._factors = splu(scaled, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options=options)
        except RuntimeError as error:
            raise SingularMatrix(f"SuperLU could not factor the matrix ({error}).") from None

    def solve(self, right: Floats) -> Floats:
        """Solutions, shape (n, n_right), for right-hand sides of that shape."""
        return self._scale[:, None] * self._factors.solve(self._scale[:, None] * right)

    def close(self) -> None:
        """Free the memory."""
        self._factors = None

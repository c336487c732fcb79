"""From cells and facets to one system of equations.

Every sum runs in a fixed order, so that the result is the same to the last byte
whatever the number of threads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from echotruth.fem.tetrahedra import Floats, Integers, Mesh
from echotruth.mechanics.solver.support import Support

CELLS, ENDO, EPI = 0, 1, 2
"""Groups of nodes that share an equation."""


class Assembly:
    """Numbers of the equations and the sums over the cells that share them.

    Attributes
    ----------
    n_equations : int
    equation : ndarray of shape (n_nodes, 3)
        Number of the equation of each displacement, -1 where it is held.
    """

    def __init__(self, mesh: Mesh, support: Support) -> None:
        self.frames = support.frames
        self.n_equations = int(support.free.sum())
        self.equation = np.full(support.free.shape, -1, dtype=np.int64)
        self.equation[support.free] = np.arange(self.n_equations)
        groups = (mesh.cells, mesh.endo, mesh.epi) if support.spring else (mesh.cells, mesh.endo)
        self._groups = [self.equation[group].reshape(len(group), -1) for group in groups]
        self._pattern(self._groups)

    def _pattern(self, groups: list[NDArray[np.int64]]) -> None:
        """Find where each entry of the packed blocks goes; what is held goes to an entry past the end."""
        n, keys = self.n_equations, []
        for equations in groups:
            first, second = (equations[:, k] for k in np.triu_indices(equations.shape[1]))
            row, column = np.minimum(first, second), np.maximum(first, second)
            keys.append(np.where(row < 0, n * n, row * n + column).ravel())
        found, place = np.unique(np.concatenate([*keys, [n * n]]), return_inverse=True)
        self._place, self._nnz = place.ravel()[:-1], len(found) - 1
        row, column = np.divmod(found[:-1], n)
        self._indices = column.astype(np.int32)
        self._indptr = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)

    def vector(self, blocks: Floats, group: int = CELLS) -> Floats:
        """Sum of block vectors.

        Parameters
        ----------
        blocks : ndarray of shape (n_cells, 30), or (n_facets, 18) for a group of facets
            In the directions of `frames`.
        group : CELLS, ENDO or EPI

        Returns
        -------
        ndarray of shape (n_equations,)
        """
        equations = self._groups[group].ravel() + 1
        return np.bincount(equations, blocks.ravel(), self.n_equations + 1)[1:]

    def matrix(self, *blocks: Floats) -> csr_matrix:
        """Sum of packed block matrices.

        Parameters
        ----------
        *blocks : ndarray of shape (n_cells, 465) or (n_facets, 171)
            Upper triangles, row by row, in the directions of `frames`: cells, endocardium and,
            where there are springs, epicardium.

        Returns
        -------
        csr_matrix of shape (n_equations, n_equations)
            Its upper triangle.
        """
        entries = np.concatenate([block.ravel() for block in blocks])
        data = np.bincount(self._place, entries, self._nnz + 1)[:-1]
        return csr_matrix((data, self._indices, self._indptr), (self.n_equations, self.n_equations))

    def spread(self, solution: Floats) -> Floats:
        """Cartesian displacement (n_nodes, 3) of a solution (n_equations,)."""
        held = np.append(solution, 0.0)[self.equation]
        return np.einsum("nk,nki->ni", held, self.frames)

    def of_cells(self, solution: Floats) -> Floats:
        """Displacements (n_cells, 30) of the cells, in the directions of `frames`."""
        return np.append(solution, 0.0)[self._groups[0]]

    def turn(self, facets: Integers, gradient: Floats) -> Floats:
        """Vectors (facet, 6, 3) in the directions of `frames`."""
        return np.einsum("faik,fak->fai", self.frames[facets], gradient)

    def pack(self, facets: Integers, hessian: Floats) -> Floats:
        """Matrices (facet, 18, 18) in the directions of `frames`, packed to (facet, 171)."""
        frame = self.frames[facets]
        turned = hessian.reshape(len(facets), 6, 3, 6, 3)
        turned = np.einsum("faik,fakbl->faibl", frame, turned)
        turned = np.einsum("fbjl,faibl->faibj", frame, turned).reshape(hessian.shape)
        return turned[:, *np.triu_indices(18)]

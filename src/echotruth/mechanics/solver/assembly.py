"""Assembly of cells and facets into one system of equations.

Every sum runs in a fixed order, so that the result is the same to the last byte
whatever the number of threads.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import Integers, Mesh
from echotruth.mechanics.solver.support import Support

CELLS, ENDO, EPI, BASE, RIGHT_ENDO = range(5)
"""Groups of elements: cells, and facets of endocardium, epicardium, base and endocardium of a right ventricle."""


class Assembly:
    """Numbers of the equations, and the sums over the elements that share them.

    Attributes
    ----------
    n_equations : int
    groups : tuple of int
        Groups of elements whose matrices are summed.
    equation : ndarray of shape (n_nodes, 3)
        Number of the equation of each displacement, -1 where it is fixed.
    """

    def __init__(self, mesh: Mesh, support: Support, surfaces: tuple[int, ...] = ()) -> None:
        self.directions = support.directions
        self.n_equations = int(support.free.sum())
        self.equation = np.full(support.free.shape, -1, dtype=np.int64)
        self.equation[support.free] = np.arange(self.n_equations)
        elements = {CELLS: mesh.cells, ENDO: mesh.endo, EPI: mesh.epi, BASE: mesh.base, RIGHT_ENDO: mesh.right_endo}
        self.groups = (CELLS, ENDO, RIGHT_ENDO, *surfaces)
        size = {n: (len(elements[n]), 3 * elements[n].shape[1]) for n in self.groups}
        self._groups = {n: self.equation[elements[n]].reshape(size[n]) for n in self.groups}
        self._find_pattern(list(self._groups.values()))

    def _find_pattern(self, groups: list[NDArray[np.int64]]) -> None:
        """Find the matrix entry of each entry of the packed blocks; an extra one takes those of fixed displacements."""
        n, keys = self.n_equations, []
        for equations in groups:
            first, second = (equations[:, k] for k in np.triu_indices(equations.shape[1]))
            row, column = np.minimum(first, second), np.maximum(first, second)
            keys.append(np.where(row < 0, n * n, row * n + column).ravel())
        entries, entry_of_block = np.unique(np.concatenate([*keys, [n * n]]), return_inverse=True)
        self._entry_of_block, self._nnz = entry_of_block.ravel()[:-1], len(entries) - 1
        row, column = np.divmod(entries[:-1], n)
        self._indices = column.astype(np.int32)
        self._indptr = np.searchsorted(row, np.arange(n + 1)).astype(np.int32)

    def vector(self, blocks: Floats, group: int = CELLS) -> Floats:
        """Sum of block vectors.

        Parameters
        ----------
        blocks : ndarray of shape (n_cells, 30), or (n_facets, 18) for a group of facets
            Along `directions`.
        group : CELLS, ENDO, EPI, BASE or RIGHT_ENDO

        Returns
        -------
        ndarray of shape (n_equations,)
        """
        equations = self._groups[group].ravel() + 1
        weights = blocks.ravel()
        return np.bincount(equations, weights, self.n_equations + 1)[1:]  # type: ignore[return-value]  # floats if weighted

    def matrix(self, *blocks: Floats) -> csr_matrix:
        """Sum of packed block matrices.

        Parameters
        ----------
        *blocks : ndarray of shape (n_cells, 465) or (n_facets, 171)
            Upper triangles, row by row, along `directions`, in the order of `groups`.

        Returns
        -------
        csr_matrix of shape (n_equations, n_equations)
            Its upper triangle.
        """
        values = np.concatenate([block.ravel() for block in blocks])
        data = np.bincount(self._entry_of_block, values, self._nnz + 1)[:-1]
        return csr_matrix((data, self._indices, self._indptr), (self.n_equations, self.n_equations))

    def displacement(self, solution: Floats) -> Floats:
        """Cartesian displacement (n_nodes, 3) of a solution (n_equations,)."""
        with_fixed = np.append(solution, 0.0)[self.equation]
        return np.einsum("nk,nki->ni", with_fixed, self.directions)

    def of_cells(self, solution: Floats) -> Floats:
        """Displacements (n_cells, 30) of the nodes of the cells, along `directions`."""
        return np.append(solution, 0.0)[self._groups[CELLS]]

    def rotate(self, facets: Integers, vectors: Floats) -> Floats:
        """Vectors (n_facets, 6, 3) at the nodes of facets, rotated to `directions`."""
        return np.einsum("faik,fak->fai", self.directions[facets], vectors)

    def pack(self, facets: Integers, matrices: Floats) -> Floats:
        """Matrices (n_facets, 18, 18) of facets, rotated to `directions` and packed to (n_facets, 171)."""
        directions = self.directions[facets]
        rotated = matrices.reshape(len(facets), 6, 3, 6, 3)
        rotated = np.einsum("faik,fakbl->faibl", directions, rotated)
        rotated = np.einsum("fbjl,faibl->faibj", directions, rotated).reshape(matrices.shape)
        return rotated[:, *np.triu_indices(18)]

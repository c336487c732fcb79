"""Matrix products in single precision, rounded alike on every machine.

A tile of the product stays in registers while the sum runs; sums run in the order of the rows, each step rounded once.
"""

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.rf.vectors import Vectors

HEIGHT, WIDTH = 4, 16
"""Rows and columns of a tile; a row is one vector."""
ROW_PADDING = 16
"""Numbers added to the rows of matrices, so that neighbouring rows do not compete for the same lines of the cache."""


def padded(count, multiple=WIDTH):
    """A count, or each of an array, rounded up to the next multiple."""
    return -(-count // multiple) * multiple


@intrinsic
def multiply_tile(typing_context, weights, rows, i, n, out, accumulate):
    """out[i : i + HEIGHT, n : n + WIDTH] = weights[:, i : i + HEIGHT].T @ rows[:, n : n + WIDTH], or += it."""
    matrix = types.Array(types.float32, 2, "C")
    if (weights, rows, out) != (matrix, matrix, matrix):
        raise TypingError("multiply_tile takes contiguous matrices of float32")

    def generate(context, builder, signature, arguments):
        weights, rows, i, n, out, accumulate = arguments
        vectors = Vectors(context, builder, WIDTH)
        zero = ir.Constant(vectors.kind, [0.0] * WIDTH)
        lines = [builder.add(i, ir.Constant(i.type, height)) for height in range(HEIGHT)]
        targets = [vectors.row_address(matrix, out, line, n) for line in lines]
        values = [builder.select(accumulate, vectors.load(target), zero) for target in targets]
        totals = [cgutils.alloca_once_value(builder, value) for value in values]
        count = builder.extract_value(context.make_array(matrix)(context, builder, rows).shape, 0)
        with cgutils.for_range(builder, count) as loop:
            right = vectors.load(vectors.row_address(matrix, rows, loop.index, n))
            for line, total in zip(lines, totals, strict=True):
                left = builder.load(vectors.element_address(matrix, weights, loop.index, line))
                builder.store(vectors.fma(vectors.broadcast(left), right, builder.load(total)), total)
        for target, total in zip(targets, totals, strict=True):
            vectors.store(builder.load(total), target)
        return context.get_dummy_value()

    return types.void(matrix, matrix, types.intp, types.intp, matrix, types.boolean), generate


@numba.njit(cache=True)
def product(weights, rows, out, upper=False, accumulate=False):
    """Write weights.T @ rows.

    Parameters
    ----------
    weights
        Shape (m, i or more), float32.
    rows
        Shape (m, n or more), float32.
    out
        Written: shape (i, n), float32; i is a multiple of HEIGHT, n of WIDTH.
    upper
        Whether only the upper triangle is needed; what is below it may be left as it is.
    accumulate
        Whether the product is added to what is in the matrix.
    """
    for n in range(0, out.shape[1], WIDTH):
        for i in range(0, min(n + WIDTH, len(out)) if upper else len(out), HEIGHT):
            multiply_tile(weights, rows, i, n, out, accumulate)

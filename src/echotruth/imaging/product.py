"""Matrix products in single precision, rounded alike on every machine.

A tile of the product stays in registers while the sum runs; sums run in the order of the rows, each step rounded once.
"""

from __future__ import annotations

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.vectors import LANES, VECTOR, Vectors

HEIGHT, WIDTH = 4, 16
"""Rows and columns of a tile."""


def padded(count: int, multiple: int = WIDTH) -> int:
    """The least multiple that is no less than a count."""
    return -(-count // multiple) * multiple


@intrinsic
def tile(typing_context, weights, rows, i, n, out):
    """out[i : i + HEIGHT, n : n + WIDTH] = weights[:, i : i + HEIGHT].T @ rows[:, n : n + WIDTH]."""
    matrix = types.Array(types.float32, 2, "C")
    if (weights, rows, out) != (matrix, matrix, matrix):
        raise TypingError("tile takes contiguous matrices of float32")

    def generate(context, builder, signature, arguments):
        weights, rows, i, n, out = arguments
        vectors = Vectors(context, builder)
        parts = range(WIDTH // LANES)
        sums = [
            [cgutils.alloca_once_value(builder, ir.Constant(VECTOR, [0.0] * LANES)) for _ in parts]
            for _ in range(HEIGHT)
        ]
        count = builder.extract_value(context.make_array(matrix)(context, builder, rows).shape, 0)
        with cgutils.for_range(builder, count) as loop:
            row, weight = vectors.place(matrix, rows, loop.index, n), vectors.place(matrix, weights, loop.index, i)
            row = builder.bitcast(row, VECTOR.as_pointer())
            right = [vectors.load(row, part) for part in parts]
            for height in range(HEIGHT):
                left = vectors.filled(builder.load(builder.gep(weight, [ir.Constant(ir.IntType(64), height)])))
                for part in parts:
                    total = sums[height][part]
                    builder.store(vectors.fused(left, right[part], builder.load(total)), total)
        for height in range(HEIGHT):
            target = vectors.place(matrix, out, builder.add(i, ir.Constant(i.type, height)), n)
            target = builder.bitcast(target, VECTOR.as_pointer())
            for part in parts:
                vectors.store(builder.load(sums[height][part]), target, part)
        return context.get_dummy_value()

    return types.void(matrix, matrix, types.intp, types.intp, matrix), generate


@numba.njit(cache=True)
def product(weights, rows, out, half=False):
    """Write weights.T @ rows to a matrix, as much of it as is asked for.

    Parameters
    ----------
    weights
        Shape (m, i or more), float32.
    rows
        Shape (m, n or more), float32.
    out
        Written: shape (i, n), float32; i is a multiple of HEIGHT, n of WIDTH.
    half
        Whether only the columns from the row on are needed; those before may be left as they are.
    """
    for n in range(0, out.shape[1], WIDTH):
        for i in range(0, min(n + WIDTH, len(out)) if half else len(out), HEIGHT):
            tile(weights, rows, i, n, out)

"""Tables of the kernels of echoes that a lens has shaped, made for every scatterer.

What the two elements of a pair hear is looked up, multiplied, and carried by linear maps to polynomials in the fraction
of a sample, in the rows that :mod:`~echotruth.imaging.deposit` adds.
"""

from __future__ import annotations

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

from echotruth.imaging.kernel import PHASES, TAPS

SKEW = 5
"""Row of the difference of what the change at either element makes, in a table that has one."""


@intrinsic
def fused(typing_context, a, b, c):
    """a b + c of float32, rounded once."""

    def generate(context, builder, signature, arguments):
        kind = ir.FloatType()
        function = ir.FunctionType(kind, [kind] * 3)
        return builder.call(get_or_insert_function(builder.module, function, "llvm.fma.f32"), arguments)

    return types.float32(types.float32, types.float32, types.float32), generate


@numba.njit(parallel=True, cache=True)
def mould(places, kinds, beams, shapes, linear, constant, entries, tables):
    """Make the tables of echoes that a lens has shaped.

    Parameters
    ----------
    places
        Row and column of every scatterer in the tables of the lens, from each part of the array, shape (scatterers,
        parts, 2).
    kinds
        Angle from the centre of the array of each, shape (scatterers,).
    beams
        What an element hears and its change, two of shape (curvatures, slopes, nodes), complex64.
    shapes
        For all angles, shape (KINDS, 4, nodes), float32.
    linear, constant
        Maps from spectra to polynomials of that degree, float32, shape (blocks, 2 nodes, PHASES 2 TAPS) and (blocks,
        2 nodes, PHASES TAPS).
    entries
        Blocks to make, shape (entries, 4): scatterer, block, part that sends and part that listens.
    tables
        Written: shape (entries, PHASES, 5, 2, TAPS), float32, or 6 in the place of 5 where there is a row for the skew.
    """
    nodes = beams[0].shape[2]
    for entry in numba.prange(len(entries)):
        k, block, sender, listener = entries[entry]
        sent, grown = between(beams[0], places[k, sender]), between(beams[1], places[k, sender])
        heard, other = sent, grown
        if listener != sender:
            heard, other = between(beams[0], places[k, listener]), between(beams[1], places[k, listener])
        # Terms: the echo, its change, the echo once more, the skew; two shapes; real and imaginary parts.
        weights = np.empty((4, 2, 2, nodes), np.float32)
        for half in range(2):
            shape, square = shapes[kinds[k], half], shapes[kinds[k], 2 + half]
            real, imaginary = weights[:, half, 0], weights[:, half, 1]
            for node in range(nodes):
                pulse, one, two = sent[node] * heard[node], grown[node] * heard[node], sent[node] * other[node]
                change, skew, part = one + two, one - two, np.float32(0.5) * shape[node]
                real[0, node], imaginary[0, node] = pulse.real * shape[node], pulse.imag * shape[node]
                real[1, node], imaginary[1, node] = change.real * part, change.imag * part
                real[2, node], imaginary[2, node] = pulse.real * square[node], pulse.imag * square[node]
                real[3, node], imaginary[3, node] = skew.real * part, skew.imag * part
        write(tables[entry], weights.reshape(4, 2, 2 * nodes), linear[block], constant[block])


@numba.njit(cache=True)
def write(table, weights, linear, constant):
    """Fill the rows (PHASES, 5 or 6, 2, TAPS) of a table from the weights (4, 2, 2 nodes) of its terms."""
    echo, change = combined(weights[0], linear), combined(weights[1], linear)
    square = combined(weights[2], constant)
    for half in range(2):
        table[:, :2, half] = echo[half].reshape(PHASES, 2, TAPS)
        table[:, 2, half] = square[half].reshape(PHASES, TAPS)
        table[:, 3:5, half] = change[half].reshape(PHASES, 2, TAPS)
    if table.shape[1] > SKEW:
        skew = combined(weights[3], constant)
        for half in range(2):
            table[:, SKEW, half] = skew[half].reshape(PHASES, TAPS)


@numba.njit(cache=True)
def between(table, place):
    """Bilinear interpolation of a table (rows, columns, nodes) at a place (row, column): (nodes,)."""
    row, column = np.int64(place[0]), np.int64(place[1])
    down, right = np.float32(place[0] - row), np.float32(place[1] - column)
    up, left = np.float32(1) - down, np.float32(1) - right
    a, b, c, d = up * left, up * right, down * left, down * right
    near, far = table[row], table[row + 1]
    found = np.empty(table.shape[2], table.dtype)
    for node in range(len(found)):
        here = a * near[column, node] + b * near[column + 1, node]
        found[node] = here + (c * far[column, node] + d * far[column + 1, node])
    return found


@numba.njit(cache=True)
def combined(weights, rows):
    """Two sums of rows (a multiple of 4, n) times weights (2, rows): shape (2, n), float32."""
    totals = np.zeros((2, rows.shape[1]), np.float32)
    one, other = totals[0], totals[1]
    for m in range(0, len(rows), 4):
        # Four at a time, so that the totals are seldom stored.
        a, b, c, d = weights[0, m], weights[0, m + 1], weights[0, m + 2], weights[0, m + 3]
        e, f, g, h = weights[1, m], weights[1, m + 1], weights[1, m + 2], weights[1, m + 3]
        for n in range(len(one)):
            x, y, z, w = rows[m, n], rows[m + 1, n], rows[m + 2, n], rows[m + 3, n]
            one[n] = fused(a, x, fused(b, y, fused(c, z, fused(d, w, one[n]))))
            other[n] = fused(e, x, fused(f, y, fused(g, z, fused(h, w, other[n]))))
    return totals

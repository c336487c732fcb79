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

from echotruth.imaging.kernel import TAPS



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
        For all angles, shape (KINDS, 2, nodes), float32.
    linear, constant
        Maps from spectra to polynomials of that degree, float32, shape (blocks, 2 nodes, phases 2 TAPS) and (blocks,
        2 nodes, phases TAPS).
    entries
        Blocks to make, shape (entries, 4): scatterer, block, part that sends and part that listens.
    tables
        Written: shape (entries, phases, 4, TAPS), float32, or 5 in the place of 4 where there is a row for the skew.
    """
    nodes = beams[0].shape[2]
    for entry in numba.prange(len(entries)):
        k, block, sender, listener = entries[entry]
        sent, grown = between(beams[0], places[k, sender]), between(beams[1], places[k, sender])
        heard, other = sent, grown
        if listener != sender:
            heard, other = between(beams[0], places[k, listener]), between(beams[1], places[k, listener])
        # Terms: the echo, its colour, its change and the skew; real and imaginary parts.
        weights = np.empty((4, 2, nodes), np.float32)
        shape, colour = shapes[kinds[k], 0], shapes[kinds[k], 1]
        for node in range(nodes):
            pulse, one, two = sent[node] * heard[node], grown[node] * heard[node], sent[node] * other[node]
            half = np.float32(0.5) * shape[node]
            change, skew = (one + two) * half, (one - two) * half
            weights[0, 0, node], weights[0, 1, node] = pulse.real * shape[node], pulse.imag * shape[node]
            weights[1, 0, node], weights[1, 1, node] = pulse.real * colour[node], pulse.imag * colour[node]
            weights[2, 0, node], weights[2, 1, node] = change.real, change.imag
            weights[3, 0, node], weights[3, 1, node] = skew.real, skew.imag
        write(tables[entry], weights.reshape(4, 2 * nodes), linear[block], constant[block])


@numba.njit(cache=True)
def write(table, weights, linear, constant):
    """Fill the rows (phases, 4 or 5, TAPS) of a table from the weights (4, 2 nodes) of its terms."""
    found = np.empty(linear.shape[1], np.float32)
    combine(weights[0], linear, found)
    for phase in range(len(table)):
        for tap in range(TAPS):
            table[phase, 0, tap] = found[2 * phase * TAPS + tap]
            table[phase, 1, tap] = found[(2 * phase + 1) * TAPS + tap]
    for term in range(1, table.shape[1] - 1):
        combine(weights[term], constant, found)
        for phase in range(len(table)):
            for tap in range(TAPS):
                table[phase, term + 1, tap] = found[phase * TAPS + tap]


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
def combine(weights, rows, total):
    """Write the sum of rows (a multiple of 8, n) times weights (rows,) to the first n of a total, float32."""
    for m in range(0, len(rows), 8):
        # Eight at a time, so that the total is seldom stored.
        a, b, c, d = weights[m], weights[m + 1], weights[m + 2], weights[m + 3]
        e, f, g, h = weights[m + 4], weights[m + 5], weights[m + 6], weights[m + 7]
        for n in range(rows.shape[1]):
            first = total[n] if m else np.float32(0)
            x, y, z, w = rows[m, n], rows[m + 1, n], rows[m + 2, n], rows[m + 3, n]
            first = fused(a, x, fused(b, y, fused(c, z, fused(d, w, first))))
            x, y, z, w = rows[m + 4, n], rows[m + 5, n], rows[m + 6, n], rows[m + 7, n]
            total[n] = fused(e, x, fused(f, y, fused(g, z, fused(h, w, first))))

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
def mould(places, kinds, beams, shapes, maps, terms, entries, tables):
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
        For all angles, shape (KINDS, 3, nodes), float32.
    maps
        From spectra to polynomials of first degree and to constants, float32, shape (blocks, 2 nodes, phases 2 TAPS)
        and (blocks, 2 nodes, phases TAPS).
    terms
        Terms of the tables and the coefficients that each has, as :data:`~echotruth.imaging.deposit.ROWS` lists them:
        shape (terms, 2).
    entries
        Blocks to make, shape (entries, 4): scatterer, block, part that sends and part that listens.
    tables
        Written: shape (entries, phases, rows, TAPS), float32.
    """
    nodes = beams[0].shape[2]
    linear, constant = maps
    for entry in numba.prange(len(entries)):
        k, block, sender, listener = entries[entry]
        sent, grown = between(beams[0], places[k, sender]), between(beams[1], places[k, sender])
        heard, other = sent, grown
        if listener != sender:
            heard, other = between(beams[0], places[k, listener]), between(beams[1], places[k, listener])
        # The echo, its colour and the square of that; none; its change and the colour of that; the skew.
        weights = np.zeros((7, 2 * nodes), np.float32)
        for node in range(nodes):
            pulse, one, two = sent[node] * heard[node], grown[node] * heard[node], sent[node] * other[node]
            change, skew = np.float32(0.5) * (one + two), np.float32(0.5) * (one - two)
            shape, colour = shapes[kinds[k], 0, node], shapes[kinds[k], 1, node]
            for term in range(3):
                part = shapes[kinds[k], term, node]
                weights[term, node], weights[term, nodes + node] = pulse.real * part, pulse.imag * part
            weights[4, node], weights[4, nodes + node] = change.real * shape, change.imag * shape
            weights[5, node], weights[5, nodes + node] = change.real * colour, change.imag * colour
            weights[6, node], weights[6, nodes + node] = skew.real * shape, skew.imag * shape
        write(tables[entry], weights, terms, linear[block], constant[block])


@numba.njit(cache=True)
def write(table, weights, terms, linear, constant):
    """Fill the rows (phases, rows, TAPS) of a table from the weights (7, 2 nodes) of its terms."""
    found, row = np.empty(linear.shape[1], np.float32), 0
    for term, count in terms:
        combine(weights[term], linear if count == 2 else constant, found)
        for phase in range(len(table)):
            for power in range(count):
                for tap in range(TAPS):
                    table[phase, row + power, tap] = found[(count * phase + power) * TAPS + tap]
        row += count


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

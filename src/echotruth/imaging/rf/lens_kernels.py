"""Tables of the kernels of echoes that a lens has shaped, made for every scatterer.

What the two elements of a pair hear is looked up, multiplied, and carried by linear maps to polynomials in the fraction
of a sample, in the rows that :mod:`~echotruth.imaging.rf.spreading` adds.
"""

from __future__ import annotations

import numba
import numpy as np

from echotruth.imaging.rf.kernel import TAPS
from echotruth.imaging.rf.product import HEIGHT, padded, product
from echotruth.imaging.rf.vectors import fused

QUADRATIC = 3
"""Coefficients of a polynomial of second degree."""


def together(blocks):
    """Entries (n,) of the same block in groups, -1 where there are too few for a whole one: shape (groups, HEIGHT)."""
    order = np.argsort(blocks, kind="stable")
    counts = np.bincount(blocks)
    sizes = padded(counts, HEIGHT)
    place = np.arange(len(order)) + np.repeat(np.cumsum(sizes) - sizes - np.cumsum(counts) + counts, counts)
    groups = np.full(sizes.sum(), -1)
    groups[place] = order
    return groups.reshape(-1, HEIGHT)


@numba.njit(parallel=True, cache=True)
def mould(places, kinds, moulds, terms, entries, groups, tables):
    """Make the tables of echoes that a lens has shaped.

    Parameters
    ----------
    places
        Row and column of every scatterer in the tables of the lens, from each part of the array, shape (scatterers,
        parts, 2).
    kinds
        Angle from the centre of the array of each, shape (scatterers,).
    moulds
        What an element hears and its change, two of shape (curvatures, slopes, 2 nodes), float32: real parts before
        imaginary ones. Shapes for all angles, (KINDS, 3, nodes), float32. Maps from spectra to polynomials of second
        and of first degree, float32, shape (blocks, 2 nodes, phases 3 TAPS) and (blocks, 2 nodes, phases 2 TAPS).
    terms
        Terms of the tables, their coefficients as :data:`.spreading.ROWS` lists them, and the spectrum
        and the shape whose product they are: shape (terms, 4).
    entries
        Blocks to make, shape (entries, 4): scatterer, block, part that sends and part that listens.
    groups
        Entries of the same block, as :func:`together` gives them.
    tables
        Written: shape (entries, phases, rows, TAPS), float32.
    """
    beams, shapes, maps = moulds
    nodes, phases = shapes.shape[2], tables.shape[1]
    for group in numba.prange(len(groups)):
        some = groups[group][groups[group] >= 0]
        spectra, weights = np.empty((HEIGHT, 3, 2 * nodes), np.float32), np.zeros((2 * nodes, HEIGHT), np.float32)
        for n, entry in enumerate(some):
            k, _, sender, listener = entries[entry]
            echoes(beams, places[k, sender], places[k, listener], sender == listener, spectra[n])
        block, row = entries[some[0], 1], 0
        for _, count, spectrum, shape in terms:
            for n, entry in enumerate(some):
                weigh(spectra[n, spectrum], shapes[kinds[entries[entry, 0]], shape], weights[:, n])
            found = np.empty((HEIGHT, count * phases * TAPS), np.float32)
            product(weights, maps[0][block] if count == QUADRATIC else maps[1][block], found)
            for n, entry in enumerate(some):
                write(tables[entry], row, count, found[n])
            row += count


@numba.njit(cache=True)
def weigh(spectrum, shape, weights):
    """Write the product of a spectrum (2 nodes,) and a shape (nodes,)."""
    for node in range(len(shape)):
        weights[node] = spectrum[node] * shape[node]
        weights[len(shape) + node] = spectrum[len(shape) + node] * shape[node]


@numba.njit(cache=True)
def write(table, row, count, found):
    """Write the coefficients (phases count TAPS,) of a term to its rows of a table (phases, rows, TAPS)."""
    for phase in range(len(table)):
        for power in range(count):
            for tap in range(TAPS):
                table[phase, row + power, tap] = found[(count * phase + power) * TAPS + tap]


@numba.njit(cache=True)
def echoes(beams, sends, listens, alike, spectra):
    """Write the spectra (3, 2 nodes) of an echo, of its change and of its skew, from the places of the two parts."""
    sent, grown = between(beams[0], sends), between(beams[1], sends)
    heard, other = sent, grown
    if not alike:
        heard, other = between(beams[0], listens), between(beams[1], listens)
    nodes = len(sent) // 2
    half = np.float32(0.5)
    for n in range(nodes):
        m = nodes + n
        spectra[0, n] = sent[n] * heard[n] - sent[m] * heard[m]
        spectra[0, m] = sent[n] * heard[m] + sent[m] * heard[n]
        one, two = grown[n] * heard[n] - grown[m] * heard[m], sent[n] * other[n] - sent[m] * other[m]
        spectra[1, n], spectra[2, n] = half * (one + two), half * (one - two)
        one, two = grown[n] * heard[m] + grown[m] * heard[n], sent[n] * other[m] + sent[m] * other[n]
        spectra[1, m], spectra[2, m] = half * (one + two), half * (one - two)


@numba.njit(cache=True)
def between(table, place):
    """Bilinear interpolation of a table (rows, columns, n), float32, at a place (row, column): (n,)."""
    row, column = np.int64(place[0]), np.int64(place[1])
    down, right = np.float32(place[0] - row), np.float32(place[1] - column)
    up, left = np.float32(1) - down, np.float32(1) - right
    a, b, c, d = up * left, up * right, down * left, down * right
    above, after = table[row, column], table[row, column + 1]
    below, beyond = table[row + 1, column], table[row + 1, column + 1]
    found = np.empty(table.shape[2], np.float32)
    for n in range(len(found)):
        found[n] = fused(a, above[n], fused(b, after[n], fused(c, below[n], d * beyond[n])))
    return found

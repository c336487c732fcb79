"""Tables of the kernels of echoes that a lens has shaped, made for every scatterer.

The responses E_i and E_j of two elements are looked up, multiplied, and carried by linear maps to polynomials in the
fraction of a sample, in the rows that :mod:`~echotruth.imaging.rf.spreading` adds.
"""

import numba
import numpy as np

from echotruth.imaging.rf.kernel import TAPS
from echotruth.imaging.rf.product import HEIGHT, padded, product
from echotruth.imaging.rf.vectors import fma

QUADRATIC = 3
"""Coefficients of a polynomial of second degree."""


def group_blocks(blocks):
    """Entries (n,) of the same block in groups, -1 where there are too few to fill one: shape (groups, HEIGHT)."""
    order = np.argsort(blocks, kind="stable")
    counts = np.bincount(blocks)
    sizes = padded(counts, HEIGHT)
    slot = np.arange(len(order)) + np.repeat(np.cumsum(sizes) - sizes - np.cumsum(counts) + counts, counts)
    groups = np.full(sizes.sum(), -1)
    groups[slot] = order
    return groups.reshape(-1, HEIGHT)


@numba.njit(nogil=True, cache=True)
def lens_kernels(index, angle, lookup, terms, entries, tables, groups, part):
    """Make the tables of echoes that a lens has shaped.

    Parameters
    ----------
    index
        Fractional row and column of every scatterer in the tables of the lens, shape (scatterers, 2).
    angle
        Angle from the centre of the array of each scatterer, as an index, shape (scatterers,).
    lookup
        Response E of an element and the residual of its derivative, two of shape (curvatures, slopes, 2 nodes),
        float32: real parts before imaginary ones. Pair spectra for all angles, (ANGLES, 3, nodes), float32. Maps from
        spectra to polynomials of second and of first degree, float32, shape (blocks, 2 nodes, phases 3 TAPS) and
        (blocks, 2 nodes, phases 2 TAPS).
    terms
        Terms of the tables, their coefficients as :data:`.spreading.COEFFICIENTS` lists them, and the spectrum under
        the lens and the pair spectrum whose product they are: shape (terms, 4).
    entries
        Blocks to make, shape (entries, 2): scatterer and block.
    tables
        Written: shape (entries, phases, rows, TAPS), float32.
    groups
        Entries of the same block, as :func:`group_blocks` gives them.
    part
        First of the groups to be made, and the one after the last.
    """
    responses, pair_spectra, maps = lookup
    nodes, width = pair_spectra.shape[2], tables.shape[1] * TAPS
    spectra, factors = np.empty((HEIGHT, 2, 2 * nodes), np.float32), np.zeros((2 * nodes, HEIGHT), np.float32)
    second, first = np.empty((HEIGHT, QUADRATIC * width), np.float32), np.empty((HEIGHT, 2 * width), np.float32)
    for group in range(*part):
        members = 0
        while members < HEIGHT and groups[group, members] >= 0:
            members += 1
        # Entry by entry: taking a row apart compiles for longer.
        for n in range(members):
            lens_spectra(responses, index[entries[groups[group, n], 0]], spectra[n])
        block, row = entries[groups[group, 0], 1], 0
        for term in range(len(terms)):
            count, spectrum, pair = terms[term, 1], terms[term, 2], terms[term, 3]
            for n in range(members):
                k = entries[groups[group, n], 0]
                multiply(spectra[n, spectrum], pair_spectra[angle[k], pair], factors[:, n])
            quadratic = count == QUADRATIC
            coefficients = second if quadratic else first
            product(factors, maps[0][block] if quadratic else maps[1][block], coefficients)
            for n in range(members):
                write_rows(tables[groups[group, n]], row, count, coefficients[n])
            row += count


@numba.njit(cache=True)
def multiply(spectrum, pair_spectrum, out):
    """Write the product of a spectrum (2 nodes,), real parts before imaginary ones, and a real one (nodes,)."""
    for node in range(len(pair_spectrum)):
        out[node] = spectrum[node] * pair_spectrum[node]
        out[len(pair_spectrum) + node] = spectrum[len(pair_spectrum) + node] * pair_spectrum[node]


@numba.njit(cache=True)
def write_rows(table, row, count, coefficients):
    """Write the coefficients (phases count TAPS,) of a term to its rows of a table (phases, rows, TAPS)."""
    for phase in range(len(table)):
        for power in range(count):
            for tap in range(TAPS):
                table[phase, row + power, tap] = coefficients[(count * phase + power) * TAPS + tap]


@numba.njit(cache=True)
def lens_spectra(responses, index, spectra):
    """Write E^2, and E' E, which is multiplied by the sum of the inverse-range offsets of two elements: (2, 2 nodes).

    E' is the residual of the derivative; both are looked up at a fractional index.
    """
    response, slope = interpolate(responses[0], index), interpolate(responses[1], index)
    nodes = len(response) // 2
    for n in range(nodes):
        m = nodes + n
        spectra[0, n] = response[n] * response[n] - response[m] * response[m]
        spectra[0, m] = response[n] * response[m] + response[m] * response[n]
        spectra[1, n] = slope[n] * response[n] - slope[m] * response[m]
        spectra[1, m] = slope[n] * response[m] + slope[m] * response[n]


@numba.njit(cache=True)
def interpolate(table, index):
    """Bilinear interpolation of a table (rows, columns, n), float32, at a fractional index (row, column): (n,)."""
    row, column = np.int64(index[0]), np.int64(index[1])
    down, right = np.float32(index[0] - row), np.float32(index[1] - column)
    up, left = np.float32(1) - down, np.float32(1) - right
    a, b, c, d = up * left, up * right, down * left, down * right
    first, second = table[row, column], table[row, column + 1]
    third, fourth = table[row + 1, column], table[row + 1, column + 1]
    values = np.empty(table.shape[2], np.float32)
    for n in range(len(values)):
        values[n] = fma(a, first[n], fma(b, second[n], fma(c, third[n], d * fourth[n])))
    return values

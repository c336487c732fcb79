"""Tables of the kernels of echoes that a lens has shaped, made for every scatterer.

The responses E_i and E_j of two elements are looked up, multiplied, and carried by linear maps to polynomials in the
fraction of a sample, in the rows that :mod:`~echotruth.imaging.rf.spreading` adds.
"""

import numba
import numpy as np

from echotruth.imaging.rf.kernel import TAPS
from echotruth.imaging.rf.product import HEIGHT, product
from echotruth.imaging.rf.vectors import fma

QUADRATIC = 3
"""Coefficients of a polynomial of second degree."""


@numba.njit(nogil=True, cache=True)
def lens_kernels(index, angle, lookup, terms, entries, order, tables, part):
    """Make the tables of echoes that a lens has shaped.

    Parameters
    ----------
    index
        Fractional row and column of every scatterer in the tables of the lens, shape (scatterers, 2).
    angle
        Angle from the centre of the array of each scatterer, as an index, shape (scatterers,).
    lookup
        Response E of an element and the residual of its derivative, or those of a pair, two of shape (curvatures,
        slopes, 2 nodes), float32: real parts before imaginary ones. Whether they are those of a pair. Pair spectra for
        all angles, (ANGLES, 3, nodes), float32. Maps from
        spectra to polynomials of second and of first degree, float32, shape (blocks, 2 nodes, phases 3 TAPS) and
        (blocks, 2 nodes, phases 2 TAPS).
    terms
        Terms of the tables, their coefficients as :data:`.spreading.COEFFICIENTS` lists them, and the spectrum under
        the lens and the pair spectrum whose product they are: shape (terms, 4).
    entries
        Blocks to make, shape (entries, 2): scatterer and block.
    order
        The entries in the order of their blocks, since the kernels of up to HEIGHT of the same block are made together.
    tables
        Written: shape (entries, phases, rows, TAPS), float32.
    part
        First of the groups of HEIGHT entries in this order that are to be made, and the one after the last.
    """
    responses, paired, pair_spectra, maps = lookup
    nodes, width = pair_spectra.shape[2], tables.shape[1] * TAPS
    spectra, factors = np.empty((HEIGHT, 2, 2 * nodes), np.float32), np.zeros((2 * nodes, HEIGHT), np.float32)
    quadratic_rows, linear_rows = np.empty((HEIGHT, 3 * width), np.float32), np.empty((HEIGHT, 2 * width), np.float32)
    looked_up = np.empty((2, 2 * nodes), np.float32)
    first, stop = HEIGHT * part[0], min(HEIGHT * part[1], len(order))
    while first < stop:
        block, members = entries[order[first], 1], 1
        while members < HEIGHT and first + members < stop and entries[order[first + members], 1] == block:
            members += 1
        # Entry by entry: taking a row apart compiles for longer.
        for n in range(members):
            lens_spectra(responses, paired, index[entries[order[first + n], 0]], looked_up, spectra[n])
        row = 0
        for term in range(len(terms)):
            count, spectrum, pair = terms[term, 1], terms[term, 2], terms[term, 3]
            for n in range(members):
                k = entries[order[first + n], 0]
                multiply(spectra[n, spectrum], pair_spectra[angle[k], pair], factors[:, n])
            quadratic = count == QUADRATIC
            coefficients = quadratic_rows if quadratic else linear_rows
            product(factors, maps[0][block] if quadratic else maps[1][block], coefficients)
            for n in range(members):
                write_rows(tables[order[first + n]], row, count, coefficients[n])
            row += count
        first += members


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
def lens_spectra(responses, paired, index, looked_up, spectra):
    """Write E^2, and E' E, which is multiplied by the sum of the inverse-range offsets of two elements: (2, 2 nodes).

    E' is the residual of the derivative; both are looked up at a fractional index, and written to `looked_up`, of the
    same shape. What stands for E^2 and E' E in a harmonic is looked up itself.
    """
    response, slope = (spectra[0], spectra[1]) if paired else (looked_up[0], looked_up[1])
    interpolate(responses[0], index, response)
    interpolate(responses[1], index, slope)
    if paired:
        return
    nodes = len(response) // 2
    for n in range(nodes):
        m = nodes + n
        spectra[0, n] = response[n] * response[n] - response[m] * response[m]
        spectra[0, m] = response[n] * response[m] + response[m] * response[n]
        spectra[1, n] = slope[n] * response[n] - slope[m] * response[m]
        spectra[1, m] = slope[n] * response[m] + slope[m] * response[n]


@numba.njit(cache=True)
def interpolate(table, index, values):
    """Write values (n,) of a table (rows, columns, n), float32, at a fractional index (row, column): bilinear."""
    row, column = np.int64(index[0]), np.int64(index[1])
    down, right = np.float32(index[0] - row), np.float32(index[1] - column)
    up, left = np.float32(1) - down, np.float32(1) - right
    a, b, c, d = up * left, up * right, down * left, down * right
    first, second = table[row, column], table[row, column + 1]
    third, fourth = table[row + 1, column], table[row + 1, column + 1]
    for n in range(len(values)):
        values[n] = fma(a, first[n], fma(b, second[n], fma(c, third[n], d * fourth[n])))

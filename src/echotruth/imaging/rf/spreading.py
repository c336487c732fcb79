"""Echoes deposited on the fast-time grids of all transmit-receive pairs.

A pair of elements is one row, and one thread writes a row in the order of the scatterers, so the sums do not depend
on the number of threads. Kernels come from tables: polynomials in the fraction of a sample, added with factors in which
a pair differs from others, its colour and its bend, each a sum over the two elements.
"""

from __future__ import annotations

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.rf.directivity import STEPS
from echotruth.imaging.rf.vectors import LANES, Vectors

FRACTION_BITS = 18
"""Times are integers in units of 2^-18 samples, so that the sum over both ways is exact."""
LEAD = 32
"""Samples of a row before time 0: room for what of a kernel comes before its echo."""

ROWS = {
    1: (3, 2, 0, 0, 2, 0, 0),
    2: (2, 2, 1, 1, 0, 0, 0),
    3: (3, 3, 2, 2, 1, 1, 0),
    4: (3, 2, 2, 0, 2, 2, 0),
    5: (3, 2, 2, 0, 2, 2, 2),
}
"""Rows of a table for every phase, by the number of a scheme: as many as the polynomial of a term has coefficients, the
highest power first. Terms are multiplied by 1, e, e^2, e^3, g, g e and the skew, e being the colour and g the bend."""
PHASE_BITS = (0, 2, 4, 4, 2, 2)
"""By the number of a scheme: its polynomials are in the fraction of a sample within each of 2^bits phases."""
APART = 5
"""Scheme for echoes that parts of the array look up apart."""
LARGEST = 0.3
"""Greatest change, logarithm of the amplitude or radians, that an element makes of what its lens hears."""
SHARES = 32
"""Parts in which threads share the transmitters; few, since each reads all tables."""


def aligned(*shape: int) -> np.ndarray:
    """Memory for tables, float32, of which no row lies across two lines of the cache (twice as fast)."""
    line, size = 64, 4 * int(np.prod(shape))
    memory = np.empty(size + line, np.uint8)
    start = -memory.ctypes.data % line
    return memory[start : start + size].view(np.float32).reshape(shape)


@intrinsic
def add_kernel(typing_context, traces, start, tables, scheme, places, factors, pair):
    """traces[start + place:][:LANES] += weight * kernel, as vectors, for the element `pair` of some pairs.

    `places` (2, pairs), int32, are the sample where the kernel begins and where its rows begin in the tables; `factors`
    (5, pairs), float32, are weight, fraction of a sample, colour, bend and skew. `scheme` is a tuple whose length is
    that of :data:`ROWS`: it is known when this is compiled, and the sums are unrolled.
    """
    single, integers = types.Array(types.float32, 1, "C"), types.Array(types.int32, 2, "C")
    if (traces, tables, places, factors) != (single, single, integers, types.Array(types.float32, 2, "C")):
        raise TypingError("add_kernel takes contiguous vectors of float32, places of int32 and factors of float32")
    signature = types.void(traces, types.intp, tables, scheme, places, factors, types.intp)

    def generate(context, builder, signature, arguments):
        traces, start, tables, _, places, factors, pair = arguments
        vectors, kinds = Vectors(context, builder), signature.args

        def of_pair(argument, array, row):
            return builder.load(vectors.place(kinds[argument], array, row, pair))

        place, row = (builder.sext(of_pair(4, places, k), pair.type) for k in range(2))
        weight, fraction, colour, bend, skew = (of_pair(5, factors, k) for k in range(5))
        rows = vectors.address(kinds[2], tables, row)
        fraction = vectors.filled(fraction)
        first, *others = ROWS[len(scheme)]
        kernel, at = vectors.polynomial(rows, 0, first, fraction), first
        square = builder.fmul(colour, colour)
        terms = colour, square, builder.fmul(square, colour), bend, builder.fmul(bend, colour), skew
        for count, factor in zip(others, terms, strict=True):
            if count:
                term = vectors.polynomial(rows, at, count, fraction)
                kernel, at = vectors.fused(term, vectors.filled(factor), kernel), at + count
        target = vectors.address(kinds[0], traces, builder.add(start, place))
        total = vectors.fused(vectors.filled(weight), kernel, vectors.load(target))
        builder.store(total, target, align=4)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def add_terms(typing_context, time, weight, colour, bend, k, j, element, table, scheme, places, factors):  # noqa: PLR0913, PLR0917
    """Write what :func:`add_kernel` takes of one element with LANES others from the `j`-th on, for scatterer `k`.

    `element` holds its time, its weight times the amplitude, colour and bend, and 1 where the square of the colour is
    taken off the bend; `table` where the table of the scatterer begins and the numbers in the rows of a phase.
    """
    matrix, integers = types.Array(types.float32, 2, "C"), types.Array(types.int32, 2, "C")
    if (time, weight, colour, bend, places, factors) != (integers, *[matrix] * 3, integers, matrix):
        raise TypingError("add_terms takes matrices of float32, and times and places of int32")
    signature = types.void(time, weight, colour, bend, types.intp, types.intp, element, table, scheme, places, factors)

    def generate(context, builder, signature, arguments):
        *others, k, j, element, table, _, places, factors = arguments
        vectors, kinds = Vectors(context, builder), signature.args
        time, weight, colour, bend = (
            builder.load(vectors.lanes(kind, array, k, j), align=4)
            for kind, array in zip(kinds[:4], others, strict=True)
        )
        late, loud, hue, bent, own = (vectors.filled(builder.extract_value(element, n)) for n in range(5))
        base, size = (vectors.filled(builder.extract_value(table, n)) for n in range(2))

        def whole(number):
            return vectors.filled(ir.Constant(ir.IntType(32), number))

        bits = FRACTION_BITS - PHASE_BITS[len(scheme)]
        at = builder.add(late, time)
        phase = builder.and_(builder.ashr(at, whole(bits)), whole((1 << PHASE_BITS[len(scheme)]) - 1))
        rest = builder.sitofp(builder.and_(at, whole((1 << bits) - 1)), weight.type)
        unit = vectors.filled(ir.Constant(ir.FloatType(), 2.0**-FRACTION_BITS))
        both = builder.fadd(hue, colour)
        contrast = builder.fmul(builder.fmul(own, both), both)
        found = (
            (builder.ashr(at, whole(FRACTION_BITS)), builder.add(builder.mul(phase, size), base)),
            (
                builder.fmul(loud, weight),
                builder.fmul(rest, unit),
                both,
                builder.fsub(builder.fadd(bent, bend), contrast),
                builder.fsub(bent, bend),
            ),
        )
        for kind, array, rows in zip(kinds[-2:], (places, factors), found, strict=True):
            for row, value in enumerate(rows):
                builder.store(value, vectors.lanes(kind, array, row, j), align=4)
        return context.get_dummy_value()

    return signature, generate


@numba.njit(parallel=True, cache=True, error_model="numpy")
def one_way(position, centres, parts, scales, directivity, tilts, lean, time, weight, colour, bend):  # noqa: PLR0913, PLR0917
    """Travel time, amplitude and colour between every scatterer and every element.

    Parameters
    ----------
    position
        Shape (scatterers, 3), m.
    centres
        Shape (elements,), m.
    parts
        Part of the array in which each of them is, shape (elements,).
    scales
        Sampling frequency over the speed of sound, 1/m; attenuation at the centre frequency, 1/m; wavelengths at the
        centre frequency per m.
    directivity
        As :func:`~echotruth.imaging.rf.directivity.tabulated`.
    tilts
        Shape (scatterers,): b of the kind of pulse of each (see :mod:`~echotruth.imaging.rf.directivity`).
    lean
        Of a lens, shape (scatterers, parts, 4): 1/range from the centre of each part of the array, 1/m, delay on each
        way, m, and growth of amplitude and phase with 1/range, m (see :mod:`~echotruth.imaging.rf.elevation`); or shape
        (0, 1, 4).
    time, weight, colour, bend
        Written: shape (scatterers, elements), int32 in 2^-18 samples, float32 in 1/m and float32. The weight is the
        directivity and the loss over the distance (spherical spreading, 1/r on each way). The bend is 1/range beyond
        that from the centre of its part, 1/m, under a lens, and else twice the square of the colour.
    """
    samples, loss, waves = scales
    unit = samples * (1 << FRACTION_BITS)
    elements = len(centres)
    for k in numba.prange(len(position)):
        axial, beside = position[k, 1] * position[k, 1], position[k, 2] * position[k, 2]
        for element in range(elements):
            lateral = (position[k, 0] - centres[element]) ** 2
            square_distance = lateral + axial + beside
            distance = np.sqrt(square_distance)
            step = STEPS * lateral / square_distance
            row = int(step)
            rest = step - row
            strength = directivity[row, 0] + rest * (directivity[row + 1, 0] - directivity[row, 0])
            hue = directivity[row, 1] + rest * (directivity[row + 1, 1] - directivity[row, 1]) - tilts[k]
            strength *= position[k, 1] / square_distance
            colour[k, element] = hue
            if loss > 0:
                strength *= np.exp(-loss * distance)
            if len(lean):
                middle, delay, louder, later = lean[k, parts[element]]
                away = 1 / np.sqrt(lateral + axial) - middle
                bend[k, element] = away
                # To first order; beyond that, beside the beam, it would grow without bounds.
                distance += delay - min(max(later * away, -LARGEST), LARGEST) / (2 * np.pi * waves)
                grown = min(max(louder * away, -LARGEST), LARGEST)
                # The exponential of so little is its Taylor polynomial to 2e-5.
                strength *= 1 + grown * (1 + grown * (1 / 2 + grown * (1 / 6 + grown / 24)))
            else:
                bend[k, element] = 2 * hue * hue
            time[k, element] = np.int32(distance * unit + 0.5)
            weight[k, element] = strength


@numba.njit(parallel=True, cache=True)
def add_echoes(traces, time, weight, colour, bend, amplitude, entries, tables, size, bounds, lens, scheme):  # noqa: PLR0913, PLR0917
    """Add the echoes of a block of scatterers to the traces of all pairs.

    Parameters
    ----------
    traces
        Shape (pairs, samples), float32; added to. Sample LEAD is time 0. Pairs (i, j), i <= j, in the order of
        `numpy.triu_indices`.
    time, weight, colour, bend
        As :func:`one_way` writes them, shape (scatterers, elements or more, a multiple of LANES).
    amplitude
        Shape (scatterers,), float32.
    entries
        Blocks of samples to add, shape (entries, 5): scatterer, place of its table, first sample from the echo, and
        the parts of the array whose elements send and listen, the former not after the latter.
    tables
        Of kernels, flat, float32.
    size
        Numbers in the rows of a phase.
    bounds
        First element of every part of the array, and their number: shape (parts + 1,).
    lens
        Whether the bend is that of a lens; else the square of the colour is taken off it, which leaves the contrast.
    scheme
        Tuple of the length by which the rows are listed in :data:`ROWS`.
    """
    elements, samples, width = bounds[-1], traces.shape[1], time.shape[1]
    flat = traces.reshape(traces.size)
    own = np.float32(lens == 0)
    for number in numba.prange(SHARES):
        places, factors = np.empty((2, width), np.int32), np.empty((5, width), np.float32)
        for entry in range(len(entries)):
            k, base, shift, sender, listener = entries[entry]
            first, last, nearest, beyond = 0, elements, 0, elements
            if len(scheme) == APART:
                first, last = bounds[sender], bounds[sender + 1]
                nearest, beyond = bounds[listener], bounds[listener + 1]
            for start in range(0, elements, SHARES):
                # Up in one round and down in the next: as many pairs for every thread.
                i = start + (np.int64(number) if start // SHARES % 2 == 0 else SHARES - 1 - np.int64(number))
                if i < first or i >= last:
                    continue
                element = time[k, i], weight[k, i] * amplitude[k], colour[k, i], bend[k, i], own
                table = np.int32(base), np.int32(size)
                for j in range(max(i, nearest) // LANES * LANES, beyond, LANES):
                    add_terms(time, weight, colour, bend, k, j, element, table, scheme, places, factors)
                row = (i * elements - i * (i + 1) // 2) * samples + LEAD + shift
                for j in range(max(i, nearest), beyond):
                    add_kernel(flat, row + j * samples, tables, scheme, places, factors, j)

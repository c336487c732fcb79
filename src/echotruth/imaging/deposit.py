"""Echoes deposited on the fast-time grids of all transmit-receive pairs.

A pair of elements is one row, and one thread writes a row in the order of the scatterers, so the sums do not depend
on the number of threads. Kernels come from tables: polynomials in the fraction of a sample, added with factors in which
a pair differs from others, its colour and its bend, each a sum over the two elements. Two polynomials stand side by
side in a row, so that one wide vector carries both; the second of them is multiplied by the colour.
"""

from __future__ import annotations

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.directivity import SLOPE, VALUE, WIDEST, polynomial
from echotruth.imaging.kernel import PHASE_BITS, PHASES, TAPS

FRACTION_BITS = 18
"""Times are integers in units of 2^-18 samples, so that the sum over both ways is exact."""
LEAD = 32
"""Samples of a row before time 0: room for what of a kernel comes before its echo."""

ROWS = {1: (2, 1, 2, 0), 2: (2, 1, 0, 0), 3: (3, 2, 1, 0), 4: (2, 1, 2, 1)}
"""Rows of a table for every phase, by the number of a scheme: so many for a pair of polynomials, then for one that is
multiplied by the square of the colour, for one that is multiplied by the bend and for one by the skew.
There are as many rows as a polynomial has coefficients, the highest power first."""
APART = 4
"""Scheme for echoes that parts of the array look up apart."""
PAIR = 2 * TAPS
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


class _Vectors:
    """Vectors of single-precision numbers in LLVM's language."""

    def __init__(self, context, builder):
        self._context, self._builder = context, builder

    def address(self, kind, array, index, width):
        data = self._context.make_array(kind)(self._context, self._builder, array).data
        return self._builder.bitcast(self._builder.gep(data, [index]), _vector(width).as_pointer())

    def load(self, address, place=0):
        return self._builder.load(self._builder.gep(address, [ir.Constant(ir.IntType(64), place)]), align=4)

    def spread(self, scalar, width):
        nothing = ir.Constant(_vector(width), ir.Undefined)
        one = self._builder.insert_element(nothing, scalar, ir.Constant(ir.IntType(32), 0))
        return self._builder.shuffle_vector(one, nothing, _lanes([0] * width))

    def part(self, vector, start):
        """TAPS numbers of a vector of PAIR."""
        nothing = ir.Constant(_vector(PAIR), ir.Undefined)
        return self._builder.shuffle_vector(vector, nothing, _lanes(range(start, start + TAPS)))

    def fused(self, a, b, c):
        """a b + c, rounded once: what comes out must not hang on how a compiler joins sums and products."""
        kind = a.type
        function = ir.FunctionType(kind, [kind] * 3)
        fused = get_or_insert_function(self._builder.module, function, f"llvm.fma.v{kind.count}f32")
        return self._builder.call(fused, [a, b, c])

    def polynomial(self, address, first, count, variable):
        value = self.load(address, first)
        for power in range(1, count):
            value = self.fused(value, variable, self.load(address, first + power))
        return value


def _vector(width):
    return ir.VectorType(ir.FloatType(), width)


def _lanes(places):
    return ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places))


@intrinsic
def add_kernel(typing_context, traces, start, table, row, scheme, weight, fraction, colour, bend, skew):  # noqa: PLR0913, PLR0917
    """traces[start:start + TAPS] += weight * kernel, as vectors, the kernel from the rows of a table at `row`.

    `scheme` is a tuple whose length is that of :data:`ROWS`: it is known when this is compiled, and the sums are
    unrolled.
    """
    single = types.Array(types.float32, 1, "C")
    if traces != single or table != single:
        raise TypingError("traces and table must be contiguous float32 vectors")
    signature = types.void(traces, types.intp, table, types.intp, scheme, *[types.float32] * 5)

    def generate(context, builder, signature, arguments):
        traces, start, table, row, _, weight, fraction, colour, bend, skew = arguments
        vectors = _Vectors(context, builder)
        rows = vectors.address(signature.args[2], table, row, PAIR)
        fraction = vectors.spread(fraction, PAIR)
        first, *others = ROWS[len(scheme)]
        value, place = vectors.polynomial(rows, 0, first, fraction), first
        square = builder.fmul(colour, colour)
        for count, factor in zip(others, (square, bend, skew), strict=True):
            if count:
                both = vectors.polynomial(rows, place, count, fraction)
                value = vectors.fused(both, vectors.spread(factor, PAIR), value)
                place += count
        kernel = vectors.fused(vectors.part(value, TAPS), vectors.spread(colour, TAPS), vectors.part(value, 0))
        target = vectors.address(signature.args[0], traces, start, TAPS)
        total = vectors.fused(vectors.spread(weight, TAPS), kernel, vectors.load(target))
        builder.store(total, target, align=4)
        return context.get_dummy_value()

    return signature, generate


@numba.njit(parallel=True, cache=True)
def one_way(position, centres, scales, tilts, lean, time, weight, colour, bend):  # noqa: PLR0913, PLR0917
    """Travel time, amplitude and colour between every scatterer and every element.

    Parameters
    ----------
    position
        Shape (scatterers, 3), m.
    centres
        Shape (elements,), m.
    scales
        Sampling frequency over the speed of sound, 1/m; square of pi times the width of an element in wavelengths;
        attenuation at the centre frequency, 1/m; wavelengths at the centre frequency per m.
    tilts
        Shape (scatterers,): b of the kind of pulse of each (see :mod:`~echotruth.imaging.directivity`).
    lean
        Of a lens, shape (scatterers, parts, 4): 1/range from the centre of each part of the array, 1/m, delay on each
        way, m, and growth of amplitude and phase with 1/range, m (see :mod:`~echotruth.imaging.elevation`); or shape
        (0, 1, 4).
    time, weight, colour, bend
        Written: shape (scatterers, elements), int32 in 2^-18 samples, float32 in 1/m and float32. The weight is the
        directivity and the loss over the distance (spherical spreading, 1/r on each way). The bend is 1/range beyond
        that from the centre of its part, 1/m, under a lens, and else twice the square of the colour.
    """
    samples, square, loss, waves = scales
    unit = samples * (1 << FRACTION_BITS)
    elements, parts = len(centres), lean.shape[1]
    for k in numba.prange(len(position)):
        axial = position[k, 1] * position[k, 1]
        beside = position[k, 2] * position[k, 2]
        for element in range(elements):
            lateral = (position[k, 0] - centres[element]) ** 2
            square_distance = lateral + axial + beside
            distance = np.sqrt(square_distance)
            wide = square * lateral / square_distance
            strength = polynomial(VALUE, wide) * position[k, 1] / square_distance * np.exp(-loss * distance)
            wide = min(wide, WIDEST)
            hue = 2 * wide * polynomial(SLOPE, wide) / polynomial(VALUE, wide) - tilts[k]
            colour[k, element] = hue
            if len(lean):
                middle, delay, louder, later = lean[k, element * parts // elements]
                away = 1 / np.sqrt(lateral + axial) - middle
                bend[k, element] = away
                # To first order; beyond that, beside the beam, it would grow without bounds.
                distance += delay - min(max(later * away, -LARGEST), LARGEST) / (2 * np.pi * waves)
                strength *= np.exp(min(max(louder * away, -LARGEST), LARGEST))
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
        As :func:`one_way` writes them, shape (scatterers, elements).
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
    elements, samples = time.shape[1], traces.shape[1]
    flat = traces.reshape(traces.size)
    rest_bits = FRACTION_BITS - PHASE_BITS
    rest = (1 << rest_bits) - 1
    unit = np.float32(1 / (1 << FRACTION_BITS))
    own = np.float32(lens == 0)
    for number in numba.prange(SHARES):
        for entry in range(len(entries)):
            k, base, shift, sender, listener = entries[entry]
            first, last, nearest, beyond = 0, elements, 0, elements
            if len(scheme) == APART:  # known when this is compiled: that no index is negative is seen for the others
                first, last = bounds[sender], bounds[sender + 1]
                nearest, beyond = bounds[listener], bounds[listener + 1]
            for start in range(0, elements, SHARES):
                # Up in one round and down in the next: as many pairs for every thread.
                i = start + (np.int64(number) if start // SHARES % 2 == 0 else SHARES - 1 - np.int64(number))
                if i < first or i >= last:
                    continue
                loud, late = weight[k, i] * amplitude[k], np.int64(time[k, i])
                hue, bent = colour[k, i], bend[k, i]
                row = (i * elements - i * (i + 1) // 2) * samples + LEAD + shift
                for j in range(max(i, nearest), beyond):
                    at = late + time[k, j]
                    phase = base + ((at >> rest_bits) & (PHASES - 1)) * size
                    fraction = np.float32(at & rest) * unit
                    place = row + j * samples + (at >> FRACTION_BITS)
                    both = hue + colour[k, j]
                    between = bent + bend[k, j] - own * both * both
                    skew, strong = bent - bend[k, j], loud * weight[k, j]
                    add_kernel(flat, place, tables, phase, scheme, strong, fraction, both, between, skew)


@numba.njit(parallel=True, cache=True)
def unfold(spectra, matrix):
    """Write spectra (pairs, bins) into the symmetric matrix (bins, elements, elements)."""
    tile = 16
    elements = matrix.shape[1]
    tiles = (matrix.shape[0] + tile - 1) // tile
    for number in numba.prange(tiles):
        stop = min((number + 1) * tile, matrix.shape[0])
        pair = 0
        for i in range(elements):
            for j in range(i, elements):
                for f in range(number * tile, stop):
                    matrix[f, i, j] = spectra[pair, f]
                    matrix[f, j, i] = spectra[pair, f]
                pair += 1

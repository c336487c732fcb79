"""Spreads echoes onto the fast-time grids of all transmit-receive pairs, as a non-uniform FFT spreads its sources.

Scatterer k of amplitude a_k adds a_k w_ki w_kj p(t - tau_ki - tau_kj) to the trace of the elements i and j, with the
one-way times tau and weights w of :func:`one_way`. A pair of elements is one row, and one thread writes a row in the
order of the scatterers, so the sums do not depend on the number of threads. Kernels p come from tables: polynomials in
the fraction of a sample, added with factors in which a pair differs from others, the sums of the spectral exponents and
of the inverse-range offsets of its two elements.
"""

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
"""Samples of a row before time 0: padding before time 0 for the leading part of a kernel."""

COEFFICIENTS = {
    1: (3, 2, 0, 0, 2, 0),
    2: (3, 3, 2, 2, 1, 1),
    3: (3, 2, 2, 0, 2, 2),
}
"""Coefficients of the polynomial of each term, by the number of a scheme; each is a row of the table of a phase, the
highest power first. The terms are multiplied by 1, e, e^2, e^3, g and g e: e is the sum of the spectral exponents b of
the two elements, g the sum of their inverse-range offsets under a lens and (b_i - b_j)^2 in the plane."""
PHASE_BITS = (0, 2, 4, 2)
"""Phase bits of each scheme: a sample is divided into 2^bits phases, with one polynomial for each."""
MAX_CORRECTION = 0.3
"""Largest correction of the lens response for an element: logarithm of the amplitude, or phase in radians."""
TRANSMIT_GROUPS = 32
"""Groups of transmitters among which threads choose; few, since each reads all tables."""


def cache_aligned(*shape: int) -> np.ndarray:
    """Memory for tables, float32, of which no row lies across two lines of the cache (twice as fast)."""
    line, size = 64, 4 * int(np.prod(shape))
    memory = np.empty(size + line, np.uint8)
    start = -memory.ctypes.data % line
    return memory[start : start + size].view(np.float32).reshape(shape)


@intrinsic
def spread_kernel(typing_context, traces, start, tables, scheme, pairs, j):
    """traces[start + sample :][:LANES] += weight * kernel, as vectors, for the pair of receiver `j`.

    `pairs` are two arrays over the receivers. The first, (2, receivers), int32, holds the sample where the kernel
    begins and where its rows begin in the tables; the second, (4, receivers), float32, the weight, the fraction of a
    sample and the factors e and g of :data:`COEFFICIENTS`. `scheme` is a tuple whose length is the number of the
    scheme: it is known when this is compiled, and the sums are unrolled.
    """
    single, outputs = types.Array(types.float32, 1, "C"), _matrices(types.int32, types.float32)
    if (traces, tables, tuple(pairs)) != (single, single, outputs):
        raise TypingError("spread_kernel takes contiguous float32 vectors, and matrices of int32 and float32 for pairs")
    signature = types.void(traces, types.intp, tables, scheme, pairs, types.intp)

    def generate(context, builder, signature, arguments):
        traces, start, tables, _, pairs, j = arguments
        vectors, kinds = Vectors(context, builder), signature.args

        def of_pair(number, row):
            matrix = builder.extract_value(pairs, number)
            return builder.load(vectors.element_address(outputs[number], matrix, row, j))

        sample, row = (builder.sext(of_pair(0, k), j.type) for k in range(2))
        weight, fraction, exponent, offset = (of_pair(1, k) for k in range(4))
        rows = vectors.address(kinds[2], tables, row)
        fraction = vectors.broadcast(fraction)
        first, *others = COEFFICIENTS[len(scheme)]
        kernel, at = vectors.polynomial(rows, 0, first, fraction), first
        square = builder.fmul(exponent, exponent)
        cube, product = builder.fmul(square, exponent), builder.fmul(offset, exponent)
        for count, factor in zip(others, (exponent, square, cube, offset, product), strict=True):
            if count:
                term = vectors.polynomial(rows, at, count, fraction)
                kernel, at = vectors.fma(term, vectors.broadcast(factor), kernel), at + count
        target = vectors.address(kinds[0], traces, builder.add(start, sample))
        total = vectors.fma(vectors.broadcast(weight), kernel, vectors.load(target))
        builder.store(total, target, align=4)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def combine(typing_context, propagation, k, j, transmitter, table, scheme, pairs):
    """Write the `pairs` of :func:`spread_kernel` for scatterer `k`, a transmitter and LANES receivers from `j` on.

    `propagation` is as :func:`one_way` writes it. `transmitter` holds the values of the transmitter therein, its weight
    times the amplitude, and 1 in the plane, where the square of e is subtracted from g, else 0; `table` where the table
    of the scatterer begins and the numbers in the rows of a phase.
    """
    inputs, outputs = _matrices(types.int32, *[types.float32] * 3), _matrices(types.int32, types.float32)
    if (tuple(propagation), tuple(pairs)) != (inputs, outputs):
        raise TypingError("combine takes matrices of int32 for times and indices, and of float32")
    signature = types.void(propagation, types.intp, types.intp, transmitter, table, scheme, pairs)

    def generate(context, builder, signature, arguments):
        propagation, k, j, transmitter, table, _, pairs = arguments
        vectors = Vectors(context, builder)
        time, weight, exponent, offset = (
            builder.load(vectors.row_address(kind, builder.extract_value(propagation, n), k, j), align=4)
            for n, kind in enumerate(inputs)
        )
        own_time, own_weight, own_exponent, own_offset, planar = (
            vectors.broadcast(builder.extract_value(transmitter, n)) for n in range(5)
        )
        base, size = (vectors.broadcast(builder.extract_value(table, n)) for n in range(2))

        def integer(number):
            return vectors.broadcast(ir.Constant(ir.IntType(32), number))

        bits = FRACTION_BITS - PHASE_BITS[len(scheme)]
        arrival = builder.add(own_time, time)
        phase = builder.and_(builder.ashr(arrival, integer(bits)), integer((1 << PHASE_BITS[len(scheme)]) - 1))
        rest = builder.sitofp(builder.and_(arrival, integer((1 << bits) - 1)), weight.type)
        unit = vectors.broadcast(ir.Constant(ir.FloatType(), 2.0**-FRACTION_BITS))
        total = builder.fadd(own_exponent, exponent)
        square = builder.fmul(builder.fmul(planar, total), total)
        values = (
            (builder.ashr(arrival, integer(FRACTION_BITS)), builder.add(builder.mul(phase, size), base)),
            (
                builder.fmul(own_weight, weight),
                builder.fmul(rest, unit),
                total,
                builder.fsub(builder.fadd(own_offset, offset), square),
            ),
        )
        for number, (kind, rows) in enumerate(zip(outputs, values, strict=True)):
            for row, value in enumerate(rows):
                target = vectors.row_address(kind, builder.extract_value(pairs, number), row, j)
                builder.store(value, target, align=4)
        return context.get_dummy_value()

    return signature, generate


def _matrices(*kinds):
    return tuple(types.Array(kind, 2, "C") for kind in kinds)


@numba.njit(cache=True, error_model="numpy")
def one_way(position, mean_exponent, lens_terms, array, propagation):
    """Write the one-way time, weight and pair terms between every scatterer and every element.

    At distance r the time is tau = r / c and the weight w = D(f0) exp(-alpha f0 r) / r, with the directivity D of
    :mod:`~echotruth.imaging.rf.directivity`. A lens adds its delay, and multiplies the weight by exp(Re(g) q) and the
    phase at f0 by Im(g) q, with the logarithmic derivative g of its response and the inverse-range offset q.

    Parameters
    ----------
    position
        Shape (scatterers, 3), m.
    mean_exponent
        Spectral exponent that is subtracted from those of each scatterer, shape (scatterers,).
    lens_terms
        As :meth:`~echotruth.imaging.rf.elevation.Lens.lens_terms` returns them, or shape (0, 4) without a lens.
    array
        Centres of the elements, shape (elements,), m; the scales: sampling
        frequency over the speed of sound, attenuation at the centre frequency, and 1/wavelength there, all 1/m; and the
        table of :func:`~echotruth.imaging.rf.directivity.directivity_table`.
    propagation
        Written: time, weight, spectral exponent b and inverse-range offset, four of shape (scatterers, elements): int32
        in 2^-18 samples, and float32, the weight in 1/m. The offset is 1/range less that at which the
        lens was looked up, 1/m, under a lens, and else 2 b^2.
    """
    centres, scales, directivity = array
    time, weight, spectral_exponent, inverse_range_offset = propagation
    samples, loss, waves = scales
    unit = samples * (1 << FRACTION_BITS)
    elements = len(centres)
    for k in range(len(position)):
        axial, beside = position[k, 1] * position[k, 1], position[k, 2] * position[k, 2]
        for element in range(elements):
            lateral = (position[k, 0] - centres[element]) ** 2
            square_distance = lateral + axial + beside
            distance = np.sqrt(square_distance)
            step = STEPS * lateral / square_distance
            row = int(step)
            rest = step - row
            strength = directivity[row, 0] + rest * (directivity[row + 1, 0] - directivity[row, 0])
            exponent = directivity[row, 1] + rest * (directivity[row + 1, 1] - directivity[row, 1]) - mean_exponent[k]
            strength *= position[k, 1] / square_distance
            spectral_exponent[k, element] = exponent
            if loss > 0:
                strength *= np.exp(-loss * distance)
            if len(lens_terms):
                inverse_range, delay, amplitude_slope, phase_slope = lens_terms[k]
                offset = 1 / np.sqrt(lateral + axial) - inverse_range
                inverse_range_offset[k, element] = offset
                # To first order; beyond that, beside the beam, it would grow without bounds.
                phase = min(max(phase_slope * offset, -MAX_CORRECTION), MAX_CORRECTION)
                distance += delay - phase / (2 * np.pi * waves)
                log_gain = min(max(amplitude_slope * offset, -MAX_CORRECTION), MAX_CORRECTION)
                # The exponential of so little is its Taylor polynomial to 2e-5.
                strength *= 1 + log_gain * (1 + log_gain * (1 / 2 + log_gain * (1 / 6 + log_gain / 24)))
            else:
                inverse_range_offset[k, element] = 2 * exponent * exponent
            time[k, element] = np.int32(distance * unit + 0.5)
            weight[k, element] = strength


@numba.njit(nogil=True, cache=True)
def spread(traces, scatterers, kernel_blocks, tables, pairs, lens, scheme, groups):
    """Add the echoes of some scatterers to the traces of all pairs.

    Parameters
    ----------
    traces
        Shape (pairs, samples), float32; added to. Sample LEAD is time 0. Pairs (i, j) of transmitter and receiver, one
        transmitter after the other.
    scatterers
        Their propagation to transmitters and to receivers as :func:`one_way` writes it, each of shape (scatterers,
        elements or more, a multiple of LANES), and their amplitude, shape (scatterers,), float32.
    kernel_blocks
        Blocks of samples to add, shape (blocks, 3): scatterer, where its table begins, first sample from the echo.
    tables
        Tables of kernels, flat, float32, and the numbers in the rows of a phase.
    pairs
        Numbers of transmitters and of receivers, and whether these are the same elements, of which only the pairs
        i <= j are there, in the order of `numpy.triu_indices`.
    lens
        Whether the inverse-range offsets are those of a lens; else the square of e is subtracted from their sum, which
        leaves (b_i - b_j)^2.
    scheme
        Tuple whose length is the number of the scheme in :data:`COEFFICIENTS`.
    groups
        First of the `TRANSMIT_GROUPS` groups of transmitters to be added, and the one after the last.
    """
    sent, received, amplitude = scatterers
    time, weight, spectral_exponent, inverse_range_offset = sent
    transmitters, receivers, is_upper = pairs
    values, size = tables
    samples, width = traces.shape[1], received[0].shape[1]
    flat = traces.reshape(traces.size)
    planar = np.float32(lens == 0)
    for group in range(*groups):
        of_pairs = np.empty((2, width), np.int32), np.empty((4, width), np.float32)
        for block in range(len(kernel_blocks)):
            k, base, shift = kernel_blocks[block]
            for start in range(0, transmitters, TRANSMIT_GROUPS):
                # Up in one round and down in the next: as many pairs for every thread.
                even = start // TRANSMIT_GROUPS % 2 == 0
                i = start + (np.int64(group) if even else TRANSMIT_GROUPS - 1 - np.int64(group))
                if i >= transmitters:
                    continue
                strength = weight[k, i] * amplitude[k]
                transmitter = time[k, i], strength, spectral_exponent[k, i], inverse_range_offset[k, i], planar
                table, first = (np.int32(base), np.int32(size)), i if is_upper else 0
                for j in range(first // LANES * LANES, receivers, LANES):
                    combine(received, k, j, transmitter, table, scheme, of_pairs)
                before = i * receivers - (i * (i + 1) // 2 if is_upper else 0)
                row = before * samples + LEAD + shift
                for j in range(first, receivers):
                    spread_kernel(flat, row + j * samples, values, scheme, of_pairs, j)


def phases_of(scheme: int) -> int:
    """Phases of a scheme, into which a sample is divided."""
    return 1 << PHASE_BITS[scheme]

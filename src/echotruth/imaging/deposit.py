"""Echoes deposited on the fast-time grids of all transmit-receive pairs.

An echo at any time is put on the grid by a short smooth kernel, the exponential of a semicircle
(Barnett, Magland, af Klinteberg 2019, SIAM J Sci Comput 41:C479); what the kernel does to the spectrum is divided
out afterwards. A pair of elements is one row, and one thread writes a row, so the sums do not depend on the number
of threads.
"""

from __future__ import annotations

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.probe import directivity

TAPS = 8
"""Grid points an echo is spread over."""
LEAD = TAPS // 2 - 1
"""Grid points of an echo before its time; rows begin this much before time 0."""
SHARPNESS = 13.5
"""beta of the kernel; the least error for a 70 % pulse at a quarter of the sampling frequency (4e-5)."""
FRACTION_BITS = 16
"""Times are integers in units of 2^-16 samples, so that the sum over both ways is exact."""
PHASE_BITS = 6
"""Kernels are tabulated for 2^6 fractions of a sample, with a slope between them."""


def kernel(offset: np.ndarray) -> np.ndarray:
    """The deposited kernel exp(beta (sqrt(1 - (2 u / TAPS)^2) - 1)) at offsets u (any shape, samples)."""
    inside = np.clip(1 - (2 * np.asarray(offset, float) / TAPS) ** 2, 0, None)
    return np.exp(SHARPNESS * (np.sqrt(inside) - 1))


def kernel_spectrum(frequency: np.ndarray) -> np.ndarray:
    """Fourier integral of the kernel at frequencies (n,), cycles per sample; real, shape (n,)."""
    node, share = np.polynomial.legendre.leggauss(128)
    offset = node * TAPS / 2
    return (np.cos(2 * np.pi * np.multiply.outer(frequency, offset)) * share * TAPS / 2 * kernel(offset)).sum(axis=1)


def kernel_table() -> np.ndarray:
    """Kernels and their slopes per sample for all phases, shape (2^PHASE_BITS * 2 * TAPS,), float32."""
    phases = 2**PHASE_BITS
    fraction = np.arange(phases + 1) / phases
    value = kernel(np.arange(TAPS) - LEAD - fraction[:, None])
    slope = np.diff(value, axis=0) * phases
    return np.concatenate([value[:-1], slope], axis=1).astype(np.float32).ravel()


@intrinsic
def add_kernel(typing_context, traces, start, table, row, step, weight):
    """traces[start:start + 8] += weight * (table[row:row + 8] + step * table[row + 8:row + 16]), as one vector."""
    single = types.Array(types.float32, 1, "C")
    if traces != single or table != single:
        raise TypingError("traces and table must be contiguous float32 vectors")
    signature = types.void(traces, types.intp, table, types.intp, types.float32, types.float32)

    def generate(context, builder, signature, arguments):
        traces, start, table, row, step, weight = arguments
        vector = ir.VectorType(ir.FloatType(), TAPS)
        lane = ir.VectorType(ir.IntType(32), TAPS)

        def address(kind, array, index):
            data = context.make_array(kind)(context, builder, array).data
            return builder.bitcast(builder.gep(data, [index]), vector.as_pointer())

        def spread(scalar):
            one = builder.insert_element(ir.Constant(vector, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0))
            return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), ir.Constant(lane, None))

        target = address(signature.args[0], traces, start)
        value = builder.load(address(signature.args[2], table, row), align=4)
        slope = builder.load(address(signature.args[2], table, builder.add(row, ir.Constant(row.type, TAPS))), align=4)
        echo = builder.fmul(spread(weight), builder.fadd(value, builder.fmul(spread(step), slope)))
        builder.store(builder.fadd(builder.load(target, align=4), echo), target, align=4)
        return context.get_dummy_value()

    return signature, generate


@numba.njit(parallel=True, cache=True)
def one_way(position, centres, samples_per_metre, width, time, weight):
    """Travel time and amplitude between every element and every scatterer.

    Parameters
    ----------
    position
        Shape (scatterers, 3), m.
    centres
        Shape (elements,), m.
    samples_per_metre
        Sampling frequency over the speed of sound, 1/m.
    width
        Width of the elements in wavelengths.
    time, weight
        Written: shape (elements, scatterers), int32 in 2^-16 samples and float32 in 1/m. The weight is the
        directivity over the distance (spherical spreading, 1/r on each way).
    """
    for element in numba.prange(len(centres)):
        for k in range(len(position)):
            lateral = position[k, 0] - centres[element]
            axial = position[k, 1]
            distance = np.sqrt(lateral * lateral + axial * axial + position[k, 2] ** 2)
            time[element, k] = np.int32(distance * samples_per_metre * (1 << FRACTION_BITS) + 0.5)
            weight[element, k] = directivity(lateral / distance, axial / distance, width) / distance


@numba.njit(parallel=True, cache=True)
def add_echoes(traces, pairs, time, weight, echo, table):
    """Add the echoes of a block of scatterers to the traces of all pairs.

    Parameters
    ----------
    traces
        Shape (pairs, samples), float32; added to. Sample LEAD is time 0.
    pairs
        Elements of each pair, shape (pairs, 2).
    time, weight
        As :func:`one_way` writes them, shape (elements, scatterers).
    echo
        Weight times the amplitude of the scatterer, shape (elements, scatterers), float32.
    table
        As :func:`kernel_table` makes it.
    """
    samples = traces.shape[1]
    flat = traces.reshape(traces.size)
    rest_bits = FRACTION_BITS - PHASE_BITS
    rest = (1 << rest_bits) - 1
    unit = np.float32(1 / (1 << FRACTION_BITS))
    for pair in numba.prange(len(pairs)):
        i, j = pairs[pair]
        base = pair * samples
        for k in range(time.shape[1]):
            at = np.int64(time[i, k]) + np.int64(time[j, k])
            row = ((at >> rest_bits) & ((1 << PHASE_BITS) - 1)) * (2 * TAPS)
            step = np.float32(at & rest) * unit
            add_kernel(flat, base + (at >> FRACTION_BITS), table, row, step, echo[i, k] * weight[j, k])


@numba.njit(parallel=True, cache=True)
def unfold(spectra, pairs, matrix):
    """Write spectra (pairs, bins) into the symmetric matrix (bins, elements, elements)."""
    tile = 16
    tiles = (matrix.shape[0] + tile - 1) // tile
    for number in numba.prange(tiles):
        stop = min((number + 1) * tile, matrix.shape[0])
        for pair in range(len(pairs)):
            i, j = pairs[pair]
            for f in range(number * tile, stop):
                matrix[f, i, j] = spectra[pair, f]
                matrix[f, j, i] = spectra[pair, f]

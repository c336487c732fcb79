"""Interpolation of channel data at any time.

The exponential of a semicircle (Barnett, Magland, af Klinteberg 2019, SIAM J Sci Comput 41:C479), turning with the
carrier, so that data sampled below the carrier are taken as they are. With the spectrum of the data divided by that
of the interpolator, the error is 1e-5 or less of a strong echo.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.kernel import TAPS, window, window_spectrum

LEAD = TAPS // 2 - 1
"""Samples of them before its time; channels begin this much before time 0."""
OVERSAMPLING = 1.25
"""Least sampling frequency over the band of the data."""
SHARPNESS = 14.0
"""Of the window that interpolates."""
PHASE_BITS = 9
"""Interpolators are tabulated for 2^9 fractions of a sample, with a slope between them."""
LANES = 4 * TAPS
"""Numbers of a tabulated interpolator: its real part at every tap, twice, then its imaginary part likewise."""


def spectrum(frequency: np.ndarray) -> np.ndarray:
    """Fourier integral of the interpolator at frequencies (n,), cycles per sample; real, shape (n,)."""
    return window_spectrum(2j * np.pi * frequency, SHARPNESS).real


def table(carrier: float) -> np.ndarray:
    """Interpolators that turn by `carrier` (cycles per sample), and their slopes per phase.

    Returns
    -------
    Shape (2^PHASE_BITS * 2 * LANES,), float32: for each fraction of a sample LANES values and LANES slopes.
    """
    fraction = np.arange(2**PHASE_BITS + 1) / 2**PHASE_BITS
    offset = fraction[:, None] - (np.arange(TAPS) - LEAD)
    turning = window(offset, SHARPNESS) * np.exp(2j * np.pi * carrier * offset)
    lanes = np.concatenate([np.repeat(turning.real, 2, axis=1), np.repeat(turning.imag, 2, axis=1)], axis=1)
    return np.concatenate([lanes[:-1], np.diff(lanes, axis=0)], axis=1).astype(np.float32).ravel()


@intrinsic
def add_taps(typing_context, sums, place, samples, start, table, row, scale):
    """Add weight * samples * (values + step * slopes) to LANES sums, tap by tap, as one vector.

    The 2 TAPS numbers from samples[start] on (real and imaginary parts in turn) are taken twice: against the real
    and against the imaginary part of the interpolator at table[row]. `scale` is (step, weight).
    """
    single = types.Array(types.float32, 1, "C")
    if (sums, samples, table) != (single, single, single):
        raise TypingError("sums, samples and table must be contiguous float32 vectors")
    signature = types.void(*(single, types.intp) * 3, types.UniTuple(types.float32, 2))

    def generate(context, builder, signature, arguments):
        sums, place, samples, start, table, row, scale = arguments
        step, weight = (builder.extract_value(scale, k) for k in range(2))

        def lanes(count, kind):
            return ir.VectorType(kind, count)

        def address(array, index, count):
            data = context.make_array(single)(context, builder, array).data
            return builder.bitcast(builder.gep(data, [index]), lanes(count, ir.FloatType()).as_pointer())

        def load(array, index, count):
            return builder.load(address(array, index, count), align=4)

        def spread(scalar, count):
            none, zero = ir.Constant(lanes(count, ir.FloatType()), ir.Undefined), ir.Constant(ir.IntType(32), 0)
            one = builder.insert_element(none, scalar, zero)
            return builder.shuffle_vector(one, none, ir.Constant(lanes(count, ir.IntType(32)), None))

        def plus_product(a, b, c):
            return builder.fadd(a, builder.fmul(b, c, flags=("contract",)), flags=("contract",))

        half = LANES // 2
        weighted = builder.fmul(load(samples, start, half), spread(weight, half))
        twice = ir.Constant(lanes(LANES, ir.IntType(32)), [k % half for k in range(LANES)])
        weighted = builder.shuffle_vector(weighted, weighted, twice)
        slope = load(table, builder.add(row, ir.Constant(row.type, LANES)), LANES)
        values = plus_product(load(table, row, LANES), spread(step, LANES), slope)
        total = plus_product(load(sums, place, LANES), weighted, values)
        builder.store(total, address(sums, place, LANES), align=4)
        return context.get_dummy_value()

    return signature, generate

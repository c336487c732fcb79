"""Interpolation of channel data at any time.

The data are those below the carrier, interpolated by the exponential of a semicircle (Barnett, Magland, af Klinteberg
2019, SIAM J Sci Comput 41:C479) and turned with the carrier. With the spectrum of the data divided by that of the
interpolator, the error is 1e-5 or less of a strong echo.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.rf.kernel import TAPS, window, window_spectrum
from echotruth.imaging.rf.vectors import LANES, Vectors

LEAD = TAPS // 2 - 1
"""Samples of them before its time; channels begin this much before time 0."""
OVERSAMPLING = 1.3
"""Least sampling frequency over the band of the data."""
SHARPNESS = 14.0
"""Of the window that interpolates."""
PHASE_BITS = 9
"""Interpolators are tabulated for 2^9 fractions of a sample, with a slope between them."""
NUMBERS = 2 * TAPS
"""Of an interpolator: each value twice, for real and imaginary part."""


def spectrum(frequency: np.ndarray) -> np.ndarray:
    """Fourier integral of the interpolator at frequencies (n,), cycles per sample; real, shape (n,)."""
    return window_spectrum(2j * np.pi * frequency, SHARPNESS).real


def table() -> np.ndarray:
    """Interpolators, and their slopes per phase.

    Returns
    -------
    Shape (2^PHASE_BITS * 2 * NUMBERS,), float32: for each fraction of a sample NUMBERS values and NUMBERS slopes.
    """
    fraction = np.arange(2**PHASE_BITS + 1) / 2**PHASE_BITS
    values = np.repeat(window(fraction[:, None] - (np.arange(TAPS) - LEAD), SHARPNESS), 2, axis=1)
    return np.concatenate([values[:-1], np.diff(values, axis=0)], axis=1).astype(np.float32).ravel()


@intrinsic
def add_taps(typing_context, sums, place, samples, start, table, row, scale):
    """Add weight * samples * (values + step * slopes) to NUMBERS sums, tap by tap.

    The samples are the NUMBERS from samples[start] on, real and imaginary parts in turn, the values those at
    table[row].
    `scale` is (step, real and imaginary part of the weight).
    """
    single = types.Array(types.float32, 1, "C")
    if (sums, samples, table) != (single, single, single):
        raise TypingError("sums, samples and table must be contiguous float32 vectors")
    signature = types.void(*(single, types.intp) * 3, types.UniTuple(types.float32, 3))

    def generate(context, builder, signature, arguments):
        sums, place, samples, start, table, row, scale = arguments
        vectors = Vectors(context, builder)
        step, real, imaginary = (vectors.filled(builder.extract_value(scale, k)) for k in range(3))
        sign = ir.Constant(real.type, [-1.0, 1.0] * (LANES // 2))
        swapped = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [k ^ 1 for k in range(LANES)])
        across = builder.fmul(imaginary, sign)
        given, values = vectors.address(single, samples, start), vectors.address(single, table, row)
        target, parts = vectors.address(single, sums, place), NUMBERS // LANES
        for part in range(parts):
            value = vectors.fused(step, vectors.load(values, parts + part), vectors.load(values, part))
            each = builder.fmul(value, vectors.load(given, part))
            total = vectors.fused(each, real, vectors.load(target, part))
            total = vectors.fused(builder.shuffle_vector(each, each, swapped), across, total)
            vectors.store(total, target, part)
        return context.get_dummy_value()

    return signature, generate

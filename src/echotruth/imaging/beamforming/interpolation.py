"""Interpolation of channel data at any time.

The data, below their carrier, are interpolated by the exponential of a semicircle (Barnett, Magland, af Klinteberg
2019, SIAM J Sci Comput 41:C479) and multiplied by the carrier. With the spectrum of the data divided by that of the
interpolator, the error is 1e-5 or less of a strong echo.
"""

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from echotruth.imaging.rf.kernel import TAPS, window, window_spectrum
from echotruth.imaging.rf.vectors import LANES, Vectors

LEAD_TAPS = TAPS // 2 - 1
"""Taps before the last at or before the time; channels begin as many samples before time 0."""
OVERSAMPLING = 1.3
"""Least sampling frequency over the band of the data."""
SHARPNESS = 14.0
"""Sharpness of the interpolating :func:`~echotruth.imaging.rf.kernel.window`."""
PHASE_BITS = 9
"""Interpolators are tabulated at 2^9 fractions of a sample (phases), and linear in between."""
TAP_FLOATS = 2 * TAPS
"""Numbers of an interpolator: each tap twice, for real and imaginary part."""


def interpolator_spectrum(frequency: np.ndarray) -> np.ndarray:
    """Fourier integral of the interpolator at frequencies (n,), cycles per sample; real, shape (n,)."""
    return window_spectrum(2j * np.pi * frequency, SHARPNESS).real


def interpolator_table() -> np.ndarray:
    """Interpolators, and their differences to those of the next phase.

    Returns
    -------
    Shape (2^PHASE_BITS * 2 * TAP_FLOATS,), float32: for each phase TAP_FLOATS values and TAP_FLOATS differences.
    """
    fraction = np.arange(2**PHASE_BITS + 1) / 2**PHASE_BITS
    values = np.repeat(window(fraction[:, None] - (np.arange(TAPS) - LEAD_TAPS), SHARPNESS), 2, axis=1)
    return np.concatenate([values[:-1], np.diff(values, axis=0)], axis=1).astype(np.float32).ravel()


@intrinsic
def add_taps(typing_context, sums, first, samples, start, table, row, scale):
    """Add weight * samples * (values + fraction * differences) to TAP_FLOATS sums, tap by tap.

    The sums are those from sums[first] on, the samples those from samples[start] on, real and imaginary parts in turn,
    and the values and differences those from table[row] on. `scale` is (fraction, real and imaginary part of weight).
    """
    single = types.Array(types.float32, 1, "C")
    if (sums, samples, table) != (single, single, single):
        raise TypingError("sums, samples and table must be contiguous float32 vectors")
    signature = types.void(*(single, types.intp) * 3, types.UniTuple(types.float32, 3))

    def generate(context, builder, signature, arguments):
        sums, first, samples, start, table, row, scale = arguments
        vectors = Vectors(context, builder)
        fraction, real, imaginary = (vectors.broadcast(builder.extract_value(scale, k)) for k in range(3))
        sign = ir.Constant(real.type, [-1.0, 1.0] * (LANES // 2))
        swapped = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [k ^ 1 for k in range(LANES)])
        signed_imaginary = builder.fmul(imaginary, sign)
        source, values = vectors.address(single, samples, start), vectors.address(single, table, row)
        target, parts = vectors.address(single, sums, first), TAP_FLOATS // LANES
        for part in range(parts):
            value = vectors.fma(fraction, vectors.load(values, parts + part), vectors.load(values, part))
            product = builder.fmul(value, vectors.load(source, part))
            total = vectors.fma(product, real, vectors.load(target, part))
            total = vectors.fma(builder.shuffle_vector(product, product, swapped), signed_imaginary, total)
            vectors.store(total, target, part)
        return context.get_dummy_value()

    return signature, generate

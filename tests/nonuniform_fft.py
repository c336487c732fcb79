"""How echoes are spread on a grid and transformed, in plain NumPy: a non-uniform fast Fourier transform of type 1.

It says what :mod:`.spreading` and :mod:`.full_matrix` do without a lens, in few lines and slowly, and serves to check
them; under a lens every scatterer has a table of its own, and g is another quantity (:data:`.spreading.COEFFICIENTS`).
The echoes of scatterers k between the elements i and j, with the one-way times tau, weights w and spectral exponents b
of :func:`.spreading.one_way`, have the spectrum

    X_ij(f) = sum_k a_k w_ki w_kj H_ij,k(f) exp(-s n_ij,k),   n_ij,k = (tau_ki + tau_kj) fs,   s = (l + 2 pi i f) / fs,

and S_ij(f) = P(f) X_ij(f) with the pulse P. H(f) is the directivity of both over that at the centre frequency, fs the
sampling frequency, n an arrival in samples, and l the rate of damping at f beyond that at the centre frequency.
Arrivals lie between the samples, so that no FFT can sum this. Instead

    1. spread:     x_ij[m] = sum_k a_k w_ki w_kj h_ij,k(m - n_ij,k),   the 8 samples m around every arrival,
    2. transform:  Y_ij(f) = sum_m x_ij[m] exp(-s m),                  an FFT in :mod:`.full_matrix`,
    3. divide:     X_ij(f) = Y_ij(f) / W(f),                           by the spectrum W of the window.

The kernel h consists of those 8 samples whose spectrum comes nearest to H W in the band of the pulse (least squares,
:func:`.kernel.fit_kernel`). Its parts c are polynomials in the fraction of a sample, the first for a mean directivity,
the others for e = b_i + b_j and g = (b_i - b_j)^2 (:func:`.directivity.pair_spectra`):

    h = c_0 + e c_1 + e^2 c_2 + e^3 c_3 + g c_4 + g e c_5.

Dutt & Rokhlin 1993, SIAM J Sci Comput 14:1368, doi 10.1137/0914081; Greengard & Lee 2004, SIAM Rev 46:443, doi
10.1137/S003614450343200X; the window is that of Barnett, Magland, af Klinteberg 2019, SIAM J Sci Comput 41:C479.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.imaging.rf.kernel import Grid, sample_offsets, window_spectrum
from echotruth.imaging.rf.spreading import LEAD


def spread(
    samples: int, amplitude: Floats, propagation: tuple[Floats, ...], tables: Floats, counts: tuple[int, ...]
) -> Floats:
    """Step 1: the traces of all pairs.

    Parameters
    ----------
    samples : int
        Length of a trace; sample `LEAD` is time 0.
    amplitude : ndarray of shape (scatterers,)
    propagation : tuple of three ndarray of shape (scatterers, elements)
        One-way time in samples, weight (1/m) and spectral exponent b.
    tables : ndarray of shape (scatterers, phases, sum of counts, TAPS)
        Coefficients of the polynomials for each of so many parts of a sample, the highest power first.
    counts : tuple of int
        How many of them belong to c_0, c_1 and so on.

    Returns
    -------
    ndarray of shape (elements, elements, samples), amplitude / m^2
    """
    elements = propagation[0].shape[1]
    traces = np.zeros((elements, elements, samples))
    for k, i, j in np.ndindex(len(amplitude), elements, elements):
        (time, weight, b), (time_j, weight_j, b_j) = ([values[k, n] for values in propagation] for n in (i, j))
        e, g = b + b_j, (b - b_j) ** 2
        sample, fraction = divmod(time + time_j, 1)
        phase, rest = divmod(fraction, 1 / tables.shape[1])
        polynomials = np.split(tables[k, int(phase)], np.cumsum(counts[:-1]))
        terms = zip((1, e, e**2, e**3, g, g * e), polynomials, strict=True)
        h = sum(factor * np.polyval(coefficients, rest) for factor, coefficients in terms)
        traces[i, j, LEAD + int(sample) + sample_offsets(1)] += amplitude[k] * weight * weight_j * h
    return traces


def transform(traces: Floats, frequency: Floats, loss: Floats, grid: Grid) -> NDArray[np.complex128]:
    """Steps 2 and 3: the spectra X at frequencies (bins,), Hz, of a loss (bins,), 1/s: (bins, elements, elements)."""
    s = grid.complex_frequency(frequency, loss)
    waves = np.exp(-np.multiply.outer(s, np.arange(traces.shape[-1]) - LEAD))
    return np.einsum("fm,ijm->fij", waves, traces) / window_spectrum(s, grid.sharpness)[:, None, None]

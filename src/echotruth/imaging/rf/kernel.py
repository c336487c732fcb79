"""Least-squares kernels that put an echo of any shape on the fast-time grid.

An echo of spectrum exp(-2 pi i f t) S(f), S smooth, is written as a few samples h_n around t: those of which the
spectrum, sum_n h_n exp(-2 pi i f t_n), comes nearest to exp(-2 pi i f t) S(f) W(f) over the band of the pulse in the
least-squares sense, with W the spectrum of a fixed window. Outside of the band it is free, which is why so few samples
suffice. Divided by W and multiplied by the spectrum of the pulse, they are the echo.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

TAPS = 8
"""Samples of a block of a kernel."""
NODES = 24
"""Frequencies at which spectra are sampled."""


_NODE, _WEIGHT = np.polynomial.legendre.leggauss(128)


def window(offset: Floats, sharpness: float) -> Floats:
    """exp(sharpness (sqrt(1 - (2 u / TAPS)^2) - 1)) at offsets u (any shape), samples."""
    inside = np.clip(1 - (2 * np.asarray(offset, float) / TAPS) ** 2, 0, None)
    return np.exp(sharpness * (np.sqrt(inside) - 1))


def window_spectrum(frequency: NDArray[np.complex128], sharpness: float) -> NDArray[np.complex128]:
    """Integral of window(u) exp(-s u) over u in samples, at complex frequencies s (n,), rad per sample: shape (n,)."""
    offset = _NODE * TAPS / 2
    decay: NDArray[np.complex128] = np.exp(-np.multiply.outer(frequency, offset))
    return decay @ (_WEIGHT * TAPS / 2 * window(offset, sharpness))


@dataclass(frozen=True)
class Grid:
    """A fast-time grid and the window that is spread over it.

    Attributes
    ----------
    sampling : float, Hz
    sharpness : float
        Sharpness of the :func:`window` of Barnett, Magland, af Klinteberg 2019, SIAM J Sci Comput 41:C479. A sharp one
        leaves room for long echoes, but needs a fine grid.
    """

    sampling: float
    sharpness: float

    def complex_frequency(self, frequency: Floats, loss: Floats) -> NDArray[np.complex128]:
        """s = (loss + 2 pi i f) / sampling, rad per sample, of frequencies f (n,), Hz, damped at rates (n,), 1/s."""
        rate: NDArray[np.complex128] = loss + 2j * np.pi * frequency
        return rate / self.sampling


@dataclass(frozen=True)
class Band:
    """The band of a pulse, sampled.

    Attributes
    ----------
    frequency : ndarray of shape (NODES,), Hz
        Gauss-Legendre nodes from the lowest to the highest frequency.
    weight : ndarray of shape (NODES,)
        Energy of the pulse that falls to each of them; their sum is 1.
    grid : Grid
    loss : ndarray of shape (NODES,), 1/s
        Rate at which the samples of the grid will be damped after all echoes are on it.
    """

    frequency: Floats
    weight: Floats
    grid: Grid
    loss: Floats


def sample_offsets(blocks: int) -> NDArray[np.int64]:
    """Samples of a kernel of so many blocks, counted from the sample at or before the echo: (blocks TAPS,)."""
    count = blocks * TAPS
    return np.arange(count) - (count // 2 - 1)


def fit_kernel(band: Band, blocks: int, fraction: float) -> tuple[NDArray[Any], NDArray[Any]]:
    """Least-squares map from a spectrum to the samples of an echo that is late by a fraction of a sample.

    Parameters
    ----------
    band : Band
    blocks : int
        Blocks of TAPS samples.
    fraction : float
        Fraction of a sample by which the echo is late.

    Returns
    -------
    taps : ndarray of shape (blocks TAPS, 2 NODES)
        Maps a spectrum S at the nodes, its real parts before the imaginary ones, to the samples.
    residual : ndarray of shape (2 NODES, 2 NODES)
        Maps the same spectrum to the error, weighted so that the sum of its squares is the energy lost.
    """
    frequency = band.grid.complex_frequency(band.frequency, band.loss)
    shifted = np.exp(-np.multiply.outer(frequency, sample_offsets(blocks) - fraction))
    shifted /= window_spectrum(frequency, band.grid.sharpness)[:, None]
    root = np.sqrt(band.weight)
    # Spectra of single samples, and the spectrum that is sought, as real numbers.
    basis = stack_real_imaginary((root[:, None] * shifted).T).T
    target = np.diag(np.concatenate([root, root]))
    taps = np.linalg.lstsq(basis, target, rcond=1e-9)[0]
    return taps, target - basis @ taps


def fit_polynomials(band: Band, blocks: int, degree: int, phases: int) -> Floats:
    """Maps from a spectrum to the polynomials in the fraction of a sample, for every phase.

    Parameters
    ----------
    band : Band
    blocks : int
    degree : int
        Degree of the polynomials.
    phases : int
        Equal parts of a sample, each with a polynomial of its own.

    Returns
    -------
    ndarray of shape (blocks, phases, degree + 1, TAPS, 2 NODES)
        The coefficient of the highest power first; the variable is the fraction of a sample beyond the phase.
    """
    step = 1 / phases
    nodes = step * (0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)))
    powers = np.linalg.inv(np.vander(nodes, degree + 1))
    taps = np.stack([[fit_kernel(band, blocks, phase * step + node)[0] for node in nodes] for phase in range(phases)])
    coefficients = np.einsum("dn,pntf->pdtf", powers, taps)
    return coefficients.reshape(phases, degree + 1, blocks, TAPS, -1).transpose(2, 0, 1, 3, 4)


def stack_real_imaginary(spectra: NDArray[np.complexfloating]) -> Floats:
    """Real parts before imaginary ones, along the last axis."""
    return np.concatenate([spectra.real, spectra.imag], axis=-1)

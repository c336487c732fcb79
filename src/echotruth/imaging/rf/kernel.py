"""Kernels that put an echo of any shape on the fast-time grid.

An echo of spectrum exp(-2 pi i f t) S(f), S smooth, is written as a few samples around t: those that come nearest to
it in the band of the pulse by least squares, with the spectrum of a fixed window in the place of the pulse. Outside of
the band they may do what they like, which is why so few suffice. Divided by the spectrum of the window and multiplied
by that of the pulse, they are the echo.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats

TAPS = 8
"""Samples of a block of a kernel."""
NODES = 24
"""Frequencies at which spectra are sampled."""


_NODE, _SHARE = np.polynomial.legendre.leggauss(128)


def window(offset: Floats, sharpness: float) -> Floats:
    """exp(sharpness (sqrt(1 - (2 u / TAPS)^2) - 1)) at offsets u (any shape), samples."""
    inside = np.clip(1 - (2 * np.asarray(offset, float) / TAPS) ** 2, 0, None)
    return np.exp(sharpness * (np.sqrt(inside) - 1))


def window_spectrum(cycles: NDArray[np.complex128], sharpness: float) -> NDArray[np.complex128]:
    """Integral of window(u) exp(-cycles u) over u in samples, for `cycles` (n,), radians a sample: shape (n,)."""
    offset = _NODE * TAPS / 2
    return np.exp(-np.multiply.outer(cycles, offset)) @ (_SHARE * TAPS / 2 * window(offset, sharpness))


@dataclass(frozen=True)
class Grid:
    """A fast-time grid and the window that is spread over it.

    Attributes
    ----------
    sampling : float, Hz
    sharpness : float
        Of the :func:`window`, that of Barnett, Magland, af Klinteberg 2019, SIAM J Sci Comput 41:C479. A sharp one
        leaves room for long echoes, but needs a fine grid.
    """

    sampling: float
    sharpness: float

    def cycles(self, frequency: Floats, loss: Floats) -> NDArray[np.complex128]:
        """Radians per sample (n,) at frequencies (n,), Hz, of a grid whose samples are damped at rates (n,), 1/s."""
        return (loss + 2j * np.pi * frequency) / self.sampling


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


def offsets(blocks: int) -> NDArray[np.int64]:
    """Places of the samples of a kernel of so many blocks, from the sample at or before the echo: (blocks TAPS,)."""
    count = blocks * TAPS
    return np.arange(count) - (count // 2 - 1)


def fit(band: Band, blocks: int, fraction: float) -> tuple[Floats, Floats]:
    """Least-squares map from a spectrum to the samples of an echo that is late by a fraction of a sample.

    Parameters
    ----------
    band : Band
    blocks : int
        Blocks of TAPS samples.
    fraction : float
        Of a sample.

    Returns
    -------
    taps : ndarray of shape (blocks TAPS, 2 NODES)
        Times a spectrum S at the nodes, its real parts before the imaginary ones, gives the samples.
    left : ndarray of shape (2 NODES, 2 NODES)
        Times the same gives what the samples miss, weighted so that the sum of its squares is the energy lost.
    """
    cycles = band.grid.cycles(band.frequency, band.loss)
    late = np.exp(-np.multiply.outer(cycles, offsets(blocks) - fraction))
    late /= window_spectrum(cycles, band.grid.sharpness)[:, None]
    root = np.sqrt(band.weight)
    # What is reached, and what is asked for, as real numbers.
    reached = stacked((root[:, None] * late).T).T
    asked = np.diag(np.concatenate([root, root]))
    taps = np.linalg.lstsq(reached, asked, rcond=1e-9)[0]
    return taps, asked - reached @ taps


def fits(band: Band, blocks: int, degree: int, phases: int) -> Floats:
    """Maps from a spectrum to the polynomials in the fraction of a sample, for every phase.

    Parameters
    ----------
    band : Band
    blocks : int
    degree : int
        Of the polynomials.
    phases : int
        Equal parts of a sample, each with a polynomial of its own.

    Returns
    -------
    ndarray of shape (blocks, phases, degree + 1, TAPS, 2 NODES)
        The coefficient of the highest power first; the variable is the fraction of a sample beyond the phase.
    """
    cell = 1 / phases
    nodes = cell * (0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)))
    powers = np.linalg.inv(np.vander(nodes, degree + 1))
    found = np.stack([[fit(band, blocks, phase * cell + node)[0] for node in nodes] for phase in range(phases)])
    coefficients = np.einsum("dn,pntf->pdtf", powers, found)
    return coefficients.reshape(phases, degree + 1, blocks, TAPS, -1).transpose(2, 0, 1, 3, 4)


def stacked(spectra: NDArray[np.complex128]) -> Floats:
    """Real parts before imaginary ones, along the last axis."""
    return np.concatenate([spectra.real, spectra.imag], axis=-1)

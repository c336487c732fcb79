"""The aperture: the elements that serve a point, and their weights.

The aperture of a point at range r is r / f_number wide, at most the whole array, and centred on the origin of its line;
where it would extend beyond the array it is shifted inwards.
"""

import numba
import numpy as np

from echotruth.config import Probe, Rf
from echotruth.imaging.rf.probe import element_centres
from echotruth.units import um

MIN_WIDTH = 2
"""Least width of an aperture, pitches, so that near points have one too."""


@numba.njit(cache=True)
def apodization_weight(offset, tapered):
    """Weight of an element (float32) at `offset` from the centre of the aperture, over the aperture's width (float32).

    cos^2(pi offset) if `tapered`, else 1; 0 outside. The cosine is its Taylor polynomial, accurate to 1e-8 in the
    aperture, because compilers vectorise polynomials.
    """
    s = np.float32(np.pi**2) * offset * offset
    inner = np.float32(1 / 40320) - s * (np.float32(1 / 3628800) - s * np.float32(1 / 479001600))
    inner = np.float32(1 / 24) - s * (np.float32(1 / 720) - s * inner)
    cosine = np.float32(1) - s * (np.float32(1 / 2) - s * inner)
    weight = cosine * cosine if tapered else np.float32(1)
    return weight if abs(offset) <= np.float32(0.5) else np.float32(0)


class Aperture:
    """Apertures of the points of lines.

    Parameters
    ----------
    probe, rf
        The array, and `apodization` and `f_number`.

    Attributes
    ----------
    centres : ndarray (elements,)
        Lateral coordinates of the elements, m.
    tapered : bool
        Whether the weights on receive are those of a Hann window, or all 1.
    """

    def __init__(self, probe: Probe, rf: Rf):
        pitch = probe.pitch_um * um
        self.centres = element_centres(probe)
        self.tapered, self._sends_tapered = (each == "hann" for each in (rf.apodization, sent_apodization(rf)))
        self._harmonic = rf.harmonic
        self._length, self._min_width, self._f_number = probe.elements * pitch, MIN_WIDTH * pitch, rf.f_number

    def centre_and_width(self, line_origin: np.ndarray, range_: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Centre and width, m, of the apertures of points at ranges (m) on lines with origins (m), as broadcast."""
        line_origin, range_ = np.broadcast_arrays(line_origin, range_)
        width = np.full(line_origin.shape, self._length)
        if self._f_number:
            width = np.clip(range_ / self._f_number, min(self._min_width, self._length), self._length)
        limit = (self._length - width) / 2
        return np.clip(line_origin, -limit, limit), width

    def weights(self, line_origin: np.ndarray, range_: float) -> np.ndarray:
        """Weights on receive (lines, elements), 1, for points at one range (m) on lines with origins (lines,), m."""
        return self._window(line_origin, range_, self.tapered)

    def sent_weights(self, line_origin: np.ndarray, range_: float) -> np.ndarray:
        """Weights on transmit of beams that are focused there, as :meth:`weights`, or of their harmonic."""
        weights = self._window(line_origin, range_, self._sends_tapered)
        return harmonic(weights) if self._harmonic else weights

    @property
    def fundamental(self) -> np.ndarray:
        """Weights of all elements, (elements,), 1, in a wave that is sent by the whole array."""
        return self._window(np.zeros(1), np.inf, self._sends_tapered)[0]

    def _window(self, line_origin: np.ndarray, range_: float, tapered: bool) -> np.ndarray:
        centre, width = self.centre_and_width(line_origin, range_)
        offset = (self.centres - centre[:, None]) / width[:, None]
        inside = np.abs(offset) <= 0.5
        return np.where(inside, np.cos(np.pi * offset) ** 2 if tapered else 1.0, 0.0)


def sent_apodization(rf: Rf) -> str:
    """Apodization of the wave that is sent."""
    return rf.transmit_apodization or rf.apodization


def harmonic(weights: np.ndarray) -> np.ndarray:
    """Weights of an array whose beam is the square of that of an array of half the frequency.

    Where a wave is in focus, its field across the beam is the Fourier transform of the weights w of the array, and the
    second harmonic, which is made by the square of the pressure, has the square of that: the transform of w * w, which
    at twice the frequency is that of an array of the same length. Off the focus the square has a phase, k (u - v)^2 / 8
    (1 / range - 1 / focus) for each pair of elements u, v and the wavenumber k of the harmonic, that is left out.

    Parameters
    ----------
    weights : ndarray of shape (n, elements)
        Of the wave that is sent, real or complex.

    Returns
    -------
    ndarray of shape (n, elements)
        Sums over all pairs whose middle is at an element.
    """
    return np.stack([np.convolve(each, each)[::2] for each in weights])

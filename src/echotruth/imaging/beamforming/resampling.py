"""Interpolation of frames that were beamformed at little more than the Nyquist rate of their echoes.

Demodulated echoes are random, with a known power spectrum over range, that of the pulse, and over the angle of a line,
that of the aperture of both ways. The value at a point between samples is the sum of the nearest samples, with the
weights for which its mean square error is least (Wiener 1949, Extrapolation, interpolation and smoothing of stationary
time series).
"""

from functools import partial

import numba
import numpy as np
from scipy import linalg

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.aperture import Aperture
from echotruth.imaging.beamforming.scan import Linear, Scan, sample_positions
from echotruth.imaging.beamforming.transmit import Transmits
from echotruth.imaging.rf.probe import pulse_band, pulse_spectrum
from echotruth.threads import share
from echotruth.units import MHz, um

TAPS = 16
"""Samples from which a value is interpolated."""
LEFT_OUT = 4e-4
"""Amplitude that lies above the Nyquist frequency of the samples, over that of the echoes."""
OVERSAMPLING = 1.6
"""Sampling frequency over range, over the band of the echoes."""
SLOWEST = 0.75
"""Least growth of the path of an echo over that of twice the range: that of an element 60 degrees aside of a line."""
FREQUENCIES = 33
"""Frequencies of the pulse at which power spectra are taken."""
NOISE = 1e-12
"""Power of the rounding errors of samples over that of the echoes."""


class Resampling:
    """Even samples of echoes along one axis, from which their values at other points follow.

    Parameters
    ----------
    points : ndarray of shape (n,)
        Points at which values are wanted, evenly spaced.
    frequency, power : ndarray of shape (m,)
        Frequencies of the echoes, cycles per unit of the points, and their power.
    count : int
        Number of samples that do.

    Attributes
    ----------
    samples : ndarray of shape (samples,)
        Evenly spaced from the first to the last of the points; the points themselves if these are no more.
    """

    def __init__(self, points: np.ndarray, frequency: np.ndarray, power: np.ndarray, count: int):
        self.samples, self._first, self._weights = points, np.arange(len(points)), np.ones((len(points), 1), np.float32)
        if count >= len(points):
            return
        self.samples = np.linspace(points[0], points[-1], count)
        taps = min(TAPS, count)
        position = (points - points[0]) / (self.samples[1] - self.samples[0])
        self._first = np.clip(position.astype(int) - taps // 2 + 1, 0, count - taps)
        near = self.samples[self._first[:, None] + np.arange(taps)]

        def correlation(distance: np.ndarray) -> np.ndarray:
            return np.cos(2 * np.pi * np.multiply.outer(distance, frequency)) @ (power / power.sum())

        among = correlation(self.samples[:taps] - self.samples[0])
        among[0] += NOISE
        self._weights = linalg.solve_toeplitz(among, correlation(near - points[:, None]).T).T.astype(np.float32)

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Values at the points (n, columns), complex64, of those of the samples (samples, columns)."""
        result = np.empty((len(self._first), values.shape[1]), np.complex64)
        share(partial(interpolate, values, self._first, self._weights, result), len(result))
        return result


@numba.njit(nogil=True, cache=True)
def interpolate(values, first, weights, result, part):
    """Write the sums of weights[n, k] values[first[n] + k] for the n from the first of `part` to before the second."""
    for n in range(*part):
        result[n] = 0
        for k in range(weights.shape[1]):
            for column in range(values.shape[1]):
                result[n, column] += weights[n, k] * values[first[n] + k, column]


def range_resampling(probe: Probe, range_: np.ndarray) -> Resampling:
    """Resampling over ranges (ranges,), m, of lines that are demodulated at the centre frequency."""
    centre, (low, high) = probe.frequency_MHz * MHz, pulse_band(probe)
    frequency = np.linspace(low, high, FREQUENCIES)
    half_band = max(high - centre, centre - SLOWEST * low)
    samples = OVERSAMPLING * 2 * half_band * 2 * (range_[-1] - range_[0]) / probe.sound_speed_m_per_s
    wavenumber = 2 * (frequency - centre) / probe.sound_speed_m_per_s
    return Resampling(range_, wavenumber, pulse_spectrum(probe, frequency) ** 2, 1 + int(np.ceil(samples)))


def line_resampling(probe: Probe, rf: Rf, scan: Scan, transmits: Transmits, depth: float) -> Resampling:
    """Resampling over the angles of the lines of a sector; a linear scan has all of its lines as samples.

    From one radian to the next, an echo of frequency f that is sent from x (:func:`sent_from`) and received at x' turns
    its phase by f (x + x') / c cycles. Its amplitude is the product of the weights of both.

    Parameters
    ----------
    probe, rf, scan
        The array and the lines that are wanted.
    transmits
        The waves that serve these lines.
    depth
        Greatest range, m.
    """
    if isinstance(scan, Linear):
        return Resampling(scan.line_origin, np.zeros(1), np.ones(1), len(scan.line_origin))
    pitch, frequency = probe.pitch_um * um, np.linspace(*pulse_band(probe), FREQUENCIES)
    aperture, whole = Aperture(probe, rf), (np.zeros(1), np.inf)
    sent = aperture.sent_weights(*whole)[0] if len(transmits.foci) else sent_from(transmits, scan, depth, pitch)
    both = np.convolve(aperture.weights(*whole)[0], sent)
    position = (np.arange(len(both)) - (len(both) - 1) / 2) * pitch
    rate = np.outer(frequency / probe.sound_speed_m_per_s, position).ravel()
    power = np.outer(pulse_spectrum(probe, frequency), both).ravel() ** 2
    fastest = np.argsort(-np.abs(rate))
    beyond = np.searchsorted(np.cumsum(power[fastest]), LEFT_OUT**2 * power.sum())
    samples = (scan.angle[-1] - scan.angle[0]) * 2 * np.abs(rate[fastest[beyond]])
    return Resampling(scan.angle, rate, power, 1 + int(np.ceil(samples)))


def sent_from(transmits: Transmits, scan: Scan, depth: float, pitch: float) -> np.ndarray:
    """Weights, a pitch apart, of the places beside the array's centre from which unfocused waves seem to come.

    A wave that comes from x reaches a line later by x than the line one radian before.
    """
    points = sample_positions(scan, np.array([depth]))
    paths = [transmits.path_length(number, *points) for number in range(len(transmits.delay))]
    farthest = np.abs(np.diff(paths, axis=1)).max() / (scan.angle[1] - scan.angle[0])
    return np.ones(2 * int(np.ceil(farthest / pitch)) + 1)

"""Receive focusing: from channel data to lines, focused at every range."""

from __future__ import annotations

import numba
import numpy as np

PHASES = 4096
"""Entries of the table of phase factors; the rounding to them is noise 65 dB and more below the signal."""


def phase_table() -> np.ndarray:
    """exp(2 pi i n / PHASES), shape (PHASES,), complex64."""
    return np.exp(2j * np.pi * np.arange(PHASES) / PHASES).astype(np.complex64)


@numba.njit(cache=True)
def add_element(line, channel, centre, sine, ranges, scales, table):
    """Add one weighted channel (samples,) to a line (ranges,): cubic interpolation and phase of the demodulation."""
    samples_per_metre, turns_per_metre = scales
    last = len(channel) - 3
    for n in range(len(ranges)):
        r = ranges[n]
        distance = np.sqrt(r * r - np.float32(2) * r * centre * sine + centre * centre)
        at = (r + distance) * samples_per_metre
        k = min(np.int64(at), last)
        u = at - np.float32(k)
        # Lagrange's cubic through the samples k - 1 to k + 2.
        a, b, c = u + np.float32(1), u - np.float32(1), u - np.float32(2)
        third = np.float32(1 / 6)
        value = (
            (a * u * b * third) * channel[k + 2]
            - (a * u * c * np.float32(0.5)) * channel[k + 1]
            + (a * b * c * np.float32(0.5)) * channel[k]
            - (u * b * c * third) * channel[k - 1]
        )
        turn = (distance - r) * turns_per_metre
        line[n] += value * table[np.int64(np.floor(turn * PHASES + np.float32(0.5))) & (PHASES - 1)]


@numba.njit(parallel=True, cache=True)
def add_channels(lines, channels, centres, weights, sine, ranges, scales, table):
    """Add all channels (lines, elements, samples) to their lines (lines, ranges); one thread makes a line."""
    for line in numba.prange(len(channels)):
        for element in range(len(centres)):
            channel = channels[line, element] * weights[element]
            add_element(lines[line], channel, centres[element], sine[line], ranges, scales, table)


class ReceiveFocus:
    """Dynamic focusing on receive along straight lines through the centre of the array.

    A point at range r was reached by the transmitted wave at r / c; its echo comes to an element after the distance
    between them, over c. The element data are delayed by both and summed with weights.

    Parameters
    ----------
    centres, weights
        Lateral coordinates (m) and weights (1) of the elements, shape (elements,).
    ranges
        Shape (ranges,), m; the first at least one sample from the array.
    sampling, frequency
        Of the channel data, and to which they are demodulated, Hz.
    sound_speed
        m/s.
    """

    def __init__(self, centres, weights, ranges, *, sampling, frequency, sound_speed):
        self._centres, self._weights, self._ranges = (np.asarray(a, np.float32) for a in (centres, weights, ranges))
        # Samples and turns of the phase per metre of path.
        self._scales = np.float32(sampling / sound_speed), np.float32(frequency / sound_speed)
        self._table = phase_table()

    def __call__(self, channels: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Focus demodulated channel data.

        Parameters
        ----------
        channels
            Shape (lines, elements, samples), complex64, from time 0 on, demodulated by exp(-2 pi i frequency time).
        angle
            Of the lines, shape (lines,), rad.

        Returns
        -------
        Shape (lines, ranges), complex64, demodulated by exp(-2 pi i frequency 2 range / c).
        """
        lines = np.zeros((len(channels), len(self._ranges)), np.complex64)
        sine = np.sin(angle).astype(np.float32)
        add_channels(lines, channels, self._centres, self._weights, sine, self._ranges, self._scales, self._table)
        return lines

"""A record of which the spectra are exact sums, in place of the engine where it is not what is tested."""

import numpy as np
import pytest

from echotruth.imaging.beamforming import scanner
from echotruth.units import MHz, um

SPEED = 1540.0


class ExactRecord:
    """Full matrix of points that send and listen alike on all sides: the float64 sum over scatterers.

    As `FullMatrix`; the record is so long that it does for all transmits.
    """

    def __init__(self, probe, depth, latest, elevation=True, harmonic=False):
        sampling, centre, bandwidth = probe.sampling_MHz * MHz, probe.frequency_MHz * MHz, probe.bandwidth
        self.samples, self.sampling = 2160, sampling
        self.centres = (np.arange(probe.elements) - (probe.elements - 1) / 2) * (probe.pitch_um * um)
        self.centre_frequency = centre
        half_band = 1.289 * bandwidth * centre
        bins = np.arange(self.samples // 2) / self.samples * sampling
        bins = np.flatnonzero(np.abs(bins - centre) < half_band)
        self.first_bin, self.frequency = int(bins[0]), bins / self.samples * sampling
        width = bandwidth * centre / np.sqrt(8 * np.log(2))
        self.pulse = np.exp(-((self.frequency - centre) ** 2) / (2 * width**2))

    def __call__(self, position, amplitude, exponent=0.0):
        distance = np.hypot(position[:, 0] - self.centres[:, None], position[:, 1])
        matrix = np.empty((len(self.frequency), len(self.centres), len(self.centres)), np.complex64)
        for k, frequency in enumerate(self.frequency):
            wave = np.exp(-2j * np.pi * frequency * distance / SPEED) / distance
            scattered = amplitude * (frequency / self.centre_frequency) ** exponent
            matrix[k] = self.pulse[k] * (wave * scattered) @ wave.T
        return matrix


@pytest.fixture(scope="session")
def record():
    """The class of exact records."""
    return ExactRecord


@pytest.fixture
def exact_record(monkeypatch, record):
    """Scanners made in the test work on exact records."""
    monkeypatch.setattr(scanner, "FullMatrix", record)

"""The autocorrelator finds the velocity of echoes of known phase, at any frequency, and wraps where it must."""

import numpy as np
import pytest

from echotruth.config import Bmode
from echotruth.imaging.beamforming.scan import Linear, Sector
from echotruth.imaging.bmode import ScanConversion
from echotruth.imaging.doppler import Estimator, along_beam, velocity_images

C, DEMODULATION, STEP, INTERVAL = 1540.0, 25e6, 7.7e-6, 4e-4
ESTIMATOR = Estimator(DEMODULATION, C, STEP, INTERVAL)
RANGE = STEP * np.arange(1, 1501)
SECTOR = Sector(np.radians(np.linspace(-32, 32, 9)))


def echoes(velocity, frequency, pulses=3):
    """Demodulated echoes (pulses, lines, ranges) of points that move towards the probe, by the formula of a pulse."""
    random = np.random.default_rng(3)
    place, strength = random.uniform(0, RANGE[-1], 4000), random.standard_normal(4000)
    lines = []
    for pulse in range(pulses):
        spikes = np.zeros(len(RANGE), complex)
        at = place - pulse * velocity * INTERVAL
        inside = (at > 0) & (at < RANGE[-1])
        # A Gaussian envelope, sampled at the range of each point: its phase is that of the two-way path.
        for r, a in zip(at[inside], strength[inside], strict=True):
            near = slice(max(int(r / STEP) - 26, 0), int(r / STEP) + 26)
            path = 4 * np.pi / C * (frequency * (RANGE[near] - r) - DEMODULATION * RANGE[near])
            spikes[near] += a * np.exp(-(((RANGE[near] - r) / 4e-5) ** 2) + 1j * path)
        lines.append(np.tile(spikes, (len(SECTOR.angle), 1)))
    return np.stack(lines).astype(np.complex64)


@pytest.mark.parametrize("frequency", [25e6, 22e6])
def test_velocity_is_that_of_the_phase_at_the_frequency_of_the_echoes_and_wraps_beyond_that_of_nyquist(frequency):
    limit = C / (4 * frequency * INTERVAL)
    for velocity in (0.3 * limit, -0.5 * limit, 1.5 * limit, -1.6 * limit):
        found, nyquist = ESTIMATOR.velocity(*ESTIMATOR.autocorrelations(echoes(velocity, frequency)))
        turns = np.floor((velocity / limit + 1) / 2)
        error = (found + 2 * turns * nyquist)[0, 100:-100] - velocity
        assert np.median(nyquist) == pytest.approx(limit, rel=1e-2)
        assert np.abs(found / nyquist).max() <= 1
        assert abs(error.mean()) < (1e-3 if turns else 1e-4) * limit
        assert error.std() < (2e-2 if turns else 1e-3) * limit


def test_more_pulses_average_out_noise():
    random, still = np.random.default_rng(1), echoes(0.0, 25e6, 9)
    noise = random.standard_normal((2, *still.shape)) * 0.3 * np.abs(still).std()
    noisy = still + (noise[0] + 1j * noise[1])
    error = [np.std(ESTIMATOR.velocity(*ESTIMATOR.autocorrelations(noisy[:pulses]))[0]) for pulses in (2, 3, 9)]
    assert error[1] < 0.75 * error[0] and error[2] < 0.5 * error[1]


def test_no_velocity_without_echo_or_outside_the_scan():
    convert = ScanConversion(SECTOR, RANGE, Bmode(size_px=64, downsampling=(1,)))
    lines = echoes(0.01, 25e6)
    lines[:, :, 800:] = 0
    for image in velocity_images(ESTIMATOR, lines, convert):
        known = np.isfinite(image)
        assert known.any() and not known[~convert.inside].any()
        assert not known[convert.inside].all()


def test_component_along_the_beam_is_positive_towards_the_probe():
    position, vector = np.array([[3e-3, 4e-3, 0.0]]), np.array([[0.05, -0.1, 7.0]])
    assert along_beam(SECTOR, position, vector) == pytest.approx(-(0.6 * 0.05 - 0.8 * 0.1))
    assert along_beam(Linear(np.linspace(-1e-3, 1e-3, 5)), position, vector) == pytest.approx(0.1)

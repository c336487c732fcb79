"""Beamforming against the float64 sum over all pairs of elements, for every transmit, scan and aperture."""

import numba
import numpy as np
import pytest

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.interpolation import PHASE_BITS
from echotruth.imaging.beamforming.receive import BLOCK_RANGES, echo_times
from echotruth.imaging.beamforming.resampling import LEFT_OUT
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.rf.probe import pulse_spectrum
from echotruth.units import MHz, um

SPEED, LENGTH = 1540.0, 64 * 46e-6
X = (np.arange(64) - 31.5) * 46e-6


pytestmark = pytest.mark.usefixtures("exact_record")


@pytest.fixture(scope="module")
def phantom():
    random = np.random.default_rng(0)
    position = np.column_stack([random.uniform([-4e-3, 2e-3], [4e-3, 9e-3], (300, 2)), np.zeros(300)])
    return position, random.standard_normal(300)


@pytest.fixture(scope="module")
def matrix(phantom, record):
    return record(Probe(), 10e-3, 0.0, 2e-5)(*phantom)


def receive_weights(rf, origin, ranges):
    """Weights (ranges, elements) of the aperture: centred on the line origin, shifted to stay in the array."""
    width = np.minimum(ranges / rf.f_number, LENGTH) if rf.f_number else np.full(len(ranges), LENGTH)
    middle = np.array([min(max(origin, (w - LENGTH) / 2), (LENGTH - w) / 2) for w in width])
    offset = (X - middle[:, None]) / width[:, None]
    return np.where(np.abs(offset) <= 0.5, np.cos(np.pi * offset) ** 2 if rf.apodization == "hann" else 1, 0)


def waves(scanner, rf, line, points):
    """Delays (s) and weights (transmits, elements) of the waves that serve a line; their paths to points (n, 2), m, and
    their shares there, each (transmits, n)."""
    direction = np.radians(rf.angle_span_deg / 2) * np.linspace(-1, 1, rf.transmits)[:, None]
    direction = np.concatenate([np.sin(direction), np.cos(direction)], axis=1)
    if rf.transmit == "plane":
        return direction[:, :1] * X / SPEED, np.ones((len(direction), 64)), direction @ points.T, 1.0
    if rf.transmit == "diverging":
        source = LENGTH / 2 / np.tan(np.radians(32))
        delay = np.hypot(X + source * direction[:, :1], source * direction[:, 1:]) - source
        path = np.linalg.norm(points + source * direction[:, None], axis=2) - source
        return delay / SPEED, np.ones(delay.shape), path, 1.0
    if rf.transmit == "synthetic_aperture":
        path = np.hypot(points[:, 0] - X[:, None], points[:, 1])
        return np.zeros((64, 64)), np.diag(np.cos(np.pi * X / LENGTH) ** 2), path, 1.0
    origin, angle = scanner.scan.line_origin[line], scanner.scan.angle[line]
    step = 1e-3 * rf.focal_spacing_mm
    foci = 6.5e-3 + step * (np.arange(rf.focal_zones)[:, None] - (rf.focal_zones - 1) / 2)
    distance = np.hypot(origin + foci * np.sin(angle) - X, foci * np.cos(angle))
    weight = receive_weights(rf, origin, foci[:, 0])
    path = np.tile(np.hypot(points[:, 0] - origin, points[:, 1]), (rf.focal_zones, 1))
    blending = np.maximum(0, 1 - np.abs(np.clip(path, foci[0], foci[-1]) - foci) / step)
    return (foci - distance) / SPEED, weight, path, blending


def exact_line(scanner, matrix, rf, line, ranges):
    """Float64 sum over all pairs of the echoes of a full matrix, delayed and weighted, at points of a line."""
    origin, angle = scanner.scan.line_origin[line], scanner.scan.angle[line]
    points = np.stack([origin + ranges * np.sin(angle), ranges * np.cos(angle)], axis=1)
    frequency = scanner.matrix.frequency
    distance = np.hypot(points[:, :1] - X, points[:, 1:])
    turn = np.exp(2j * np.pi / SPEED * np.multiply.outer(frequency, distance)) * receive_weights(rf, origin, ranges)
    delay, weight, path, blending = waves(scanner, rf, line, points)
    blending = np.broadcast_to(blending, path.shape)
    received = matrix @ (weight * np.exp(-2j * np.pi * frequency[:, None, None] * delay)).transpose(0, 2, 1)
    total = np.empty(len(ranges), complex)
    for k in range(len(ranges)):
        sent = blending[:, k] * np.exp(2j * np.pi / SPEED * np.multiply.outer(frequency, path[:, k]))
        total[k] = np.einsum("fit,fi,ft", received, turn[:, k], sent, optimize=True)
    # Twice the positive frequencies, by the inverse transform of a record; then demodulated.
    return 2 * total / scanner.matrix.samples * np.exp(-4j * np.pi * scanner.frequency * ranges / SPEED)


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"focal_zones": 2, "focal_spacing_mm": 3.0, "f_number": 2.5},
        {"apodization": "none"},
        {"scan": "linear", "f_number": 3.0},
        {"transmit": "plane", "transmits": 3},
        {"transmit": "plane", "transmits": 2, "scan": "linear", "f_number": 2.0},
        {"transmit": "diverging", "transmits": 3},
        {"transmit": "synthetic_aperture"},
    ],
    ids=lambda keys: " ".join(map(str, keys.values())) or "default",
)
def test_a_point_of_a_line_is_the_exact_delayed_sum_over_all_pairs(matrix, keys):
    rf = Rf(lines=16, **keys)
    scanner = Scanner(Probe(), rf, 10e-3)
    lines, chosen = scanner.beamform(matrix), np.arange(260, 1200, 131)
    for line in (2, 9):
        exact = exact_line(scanner, matrix.astype(complex), rf, line, scanner.range[chosen])
        assert np.linalg.norm(lines[line, chosen] - exact) < 3e-5 * np.linalg.norm(exact)


def test_it_holds_for_other_arrays():
    """The interpolation is as good at any band, also a narrow one that is sampled below its carrier."""
    probe = Probe(preset="human_2_7MHz", bandwidth=0.2)
    wavelength = SPEED / (probe.frequency_MHz * MHz)
    rf = Rf(lines=16, focus_mm=6.5, focal_zones=1)
    scanner = Scanner(probe, rf, 160 * wavelength)
    random = np.random.default_rng(3)
    shape = (len(scanner.matrix.frequency), 64, 64)
    pulse = pulse_spectrum(probe, scanner.matrix.frequency)[:, None, None]
    matrix = (pulse * (random.standard_normal(shape) + 1j * random.standard_normal(shape))).astype(np.complex64)
    lines = scanner.beamform(matrix)
    position = scanner.matrix.centres
    ranges, angle = scanner.range[200:900:97], scanner.scan.angle[4]
    aim = (6.5e-3 - np.hypot(6.5e-3 * np.sin(angle) - position, 6.5e-3 * np.cos(angle))) / SPEED
    weight = np.cos(np.pi * position / (64 * (probe.pitch_um * um))) ** 2
    frequency = scanner.matrix.frequency[:, None]
    received = np.einsum("fij,fj->fi", matrix.astype(complex), weight * np.exp(-2j * np.pi * frequency * aim))
    exact = np.empty(len(ranges), complex)
    for k, range_ in enumerate(ranges):
        time = (range_ + np.hypot(range_ * np.sin(angle) - position, range_ * np.cos(angle))) / SPEED
        exact[k] = (received * np.exp(2j * np.pi * frequency * time) * weight).sum()
    exact *= 2 / scanner.matrix.samples * np.exp(-4j * np.pi * scanner.frequency * ranges / SPEED)
    assert np.linalg.norm(lines[4, 200:900:97] - exact) < 3e-5 * np.linalg.norm(exact)


@pytest.mark.parametrize("keys", [{}, {"transmit": "diverging", "transmits": 2}])
def test_line_bytes_do_not_depend_on_threads(matrix, keys):
    scanner, results = Scanner(Probe(), Rf(lines=70, **keys), 10e-3), []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        results.append(scanner.beamform(matrix).tobytes())
    numba.set_num_threads(1)
    assert results[0] == results[1]


def test_times_just_before_a_sample_belong_to_the_sample_before():
    """Right to the last bit: rounded up, they would ask for an interpolator beyond the table."""
    early = np.nextafter(np.arange(1.0, BLOCK_RANGES + 1), 0)
    geometry = np.zeros((4, BLOCK_RANGES))
    times = np.empty(BLOCK_RANGES), *np.empty((2, BLOCK_RANGES), np.int32), *np.empty((3, BLOCK_RANGES), np.float32)
    echo_times(early, geometry, (0, BLOCK_RANGES), 0.0, (1.0, 10**6, 0.25), False, times)
    assert (times[1] == np.arange(BLOCK_RANGES)).all()
    assert (times[2] == 2**PHASE_BITS - 1).all()


def test_echoes_out_of_the_record_weigh_nothing():
    path = np.array([-1.0, -1e-9, 0.0, 9.5, 10.0, np.inf])
    times = np.empty(6), *np.empty((2, 6), np.int32), *np.empty((3, 6), np.float32)
    echo_times(path, np.zeros((4, 6)), (0, 6), 0.0, (1.0, 10, 0.25), False, times)
    assert np.hypot(*times[-2:]) == pytest.approx([0, 0, 1, 1, 0, 0], abs=1e-6)


@pytest.mark.parametrize("keys", [{}, {"transmit": "diverging"}])
def test_lines_closer_than_echoes_change_are_those_that_would_be_focused_one_by_one(matrix, keys):
    """Every fourth line of a frame of 257 is a line of one of 65, of which each is focused."""
    few, many = (Scanner(Probe(), Rf(lines=n, **keys), 10e-3).beamform(matrix) for n in (65, 257))
    assert np.linalg.norm(many[::4] - few) < 1.5 * LEFT_OUT * np.linalg.norm(few)


def test_blocks_of_transmits_change_nothing(matrix):
    """Every other line of a linear scan, of which all lines are focused, is a line of a scan with half as many."""
    few, many = (Scanner(Probe(), Rf(lines=n, scan="linear"), 10e-3).beamform(matrix) for n in (65, 129))
    assert np.linalg.norm(many[::2] - few) < 1e-5 * np.linalg.norm(few)

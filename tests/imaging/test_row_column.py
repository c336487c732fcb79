"""Echoes of a row-column array against sums that are written from the formulas alone, and the volumes made of them."""

import numpy as np
import pytest

from echotruth.config import Probe
from echotruth.config.building import configure
from echotruth.imaging.beamforming.volume import VolumeScanner
from echotruth.imaging.rf.probe import pulse_spectrum
from echotruth.imaging.rf.row_column import RowColumn

PROBE = Probe(preset="mouse_row_column_15MHz", elements=48, pitch_um=180.0)
DEPTH, SPEED, WIDTH = 11e-3, 1540.0, PROBE.width_um * 1e-6
BINS = slice(None, None, 25)


@pytest.fixture(scope="module")
def array():
    return RowColumn(PROBE, DEPTH)


def scatterers(number, seed=0, half=(2.6e-3, 3.2e-3)):
    """Positions (n, 3), m, over the heart of a mouse, and amplitudes (n,)."""
    random = np.random.default_rng(seed)
    low, high = (-half[0], 3.6e-3, -half[1]), (half[0], 9.6e-3, half[1])
    return random.uniform(low, high, (number, 3)), random.standard_normal(number)


def in_plane(probe, centres, across, axial, frequency):
    """Wave of every strip at every scatterer without what is along it, by stationary phase, (strips, scatterers)."""
    distance = np.hypot(across - centres[:, None], axial)
    loss = probe.attenuation_dB_per_cm_MHz * 100 / 1e6 * np.log(10) / 20
    directivity = np.sinc(WIDTH * frequency / SPEED * (across - centres[:, None]) / distance) * axial / distance
    wave = np.exp(-(loss + 2j * np.pi / SPEED) * frequency * distance)
    return directivity * wave * np.sqrt(SPEED / frequency / (1j * distance))


def exact(array, probe, position, amplitude, exponent=0.0, bins=BINS):
    """Spectra (bins, columns, rows) at every 25th frequency, or others, in float64."""
    ends = array.sensitivity(position[:, [0, 2]])
    spectra = []
    for frequency in array.frequency[bins]:
        columns = in_plane(probe, array.centres, position[:, 0], position[:, 1], frequency) * ends[:, 1]
        rows = in_plane(probe, array.centres, position[:, 2], position[:, 1], frequency) * ends[:, 0]
        strength = amplitude * (frequency / (probe.frequency_MHz * 1e6)) ** exponent
        spectra.append(pulse_spectrum(probe, frequency) * (columns * strength) @ rows.T)
    return np.array(spectra)


def error(found, true):
    return np.linalg.norm(found - true) / np.linalg.norm(true)


@pytest.mark.parametrize("exponent", [0.0, 2.0])
def test_echoes_are_those_of_the_exact_sum(array, exponent):
    position, amplitude = scatterers(60)
    assert error(array(position, amplitude, exponent)[BINS], exact(array, PROBE, position, amplitude, exponent)) < 1e-3


def test_volume_is_that_of_the_exact_sum():
    scanner = VolumeScanner(configure(probe=PROBE, volume={"size": [36, 20, 18], "field_mm": [6.9, 6.9, 6.9]}))
    array, (position, amplitude) = scanner.matrix, scatterers(60)
    true = exact(array, PROBE, position, amplitude, bins=slice(None)).astype(np.complex64)
    assert error(scanner.beamform(array(position, amplitude)), scanner.beamform(true)) < 1e-3


def test_echoes_with_attenuation_are_those_of_the_exact_sum():
    probe = PROBE.model_copy(update={"attenuation_dB_per_cm_MHz": 0.5})
    array, (position, amplitude) = RowColumn(probe, DEPTH), scatterers(40)
    assert error(array(position, amplitude)[BINS], exact(array, probe, position, amplitude)) < 1e-3


ALONG = np.arange(-PROBE.elements * PROBE.pitch_um / 2, PROBE.elements * PROBE.pitch_um / 2, SPEED / 25 / 8) * 1e-6
"""Points an eighth of a wavelength apart along a strip, m."""


def spherical_waves(array, centres, position, across, frequency):
    """Waves of strips side by side along one axis at scatterers (strips, scatterers): the sum over `ALONG`."""
    offset = position[:, across] - centres[:, None]
    square = (offset**2 + position[:, 1] ** 2)[..., None]
    distance = np.sqrt(square + (position[:, 2 - across, None] - ALONG) ** 2)
    # Directivity of the width, and of the soft baffle.
    sine, cosine = offset[..., None] / distance, position[:, 1, None] / distance
    wave = np.sinc(WIDTH * frequency / SPEED * sine) * cosine * np.exp(-2j * np.pi * frequency / SPEED * distance)
    return (wave / distance) @ array.sensitivity(ALONG) * (ALONG[1] - ALONG[0])


def test_strips_are_those_of_finite_height_with_tapered_ends_by_quadrature(array):
    position, amplitude = scatterers(8, half=(2.2e-3, 2.2e-3))
    spectra = []
    for frequency in array.frequency[BINS]:
        ways = [spherical_waves(array, array.centres, position, across, frequency) for across in (0, 2)]
        spectra.append(pulse_spectrum(PROBE, frequency) * (ways[0] * amplitude) @ ways[1].T)
    assert error(array(position, amplitude)[BINS], np.array(spectra)) < 0.01


def test_waves_along_a_strip_are_those_of_pymust(array):
    """Its elements are the points of the quadrature, and its pulse is one factor of each frequency."""
    pymust, (position, _) = pytest.importorskip("pymust"), scatterers(40)
    param, options = pymust.utils.Param(), pymust.utils.Options()
    param.fc, param.bandwidth, param.c, param.baffle = 15.6e6, 70, SPEED, "soft"
    param.elements, param.width = np.stack([np.full(len(ALONG), array.centres[20]), ALONG]), WIDTH
    param.height, param.TXapodization = ALONG[1] - ALONG[0], array.sensitivity(ALONG)
    options.FullFrequencyDirectivity, options.dBThresh, options.FrequencyStep = True, -20, 4.0
    options.ElementSplitting = [1, 1]
    lateral, axial, elevation = position.T[..., None, None]
    _, theirs, used = pymust.pfield3(lateral, elevation, axial, np.zeros((1, len(ALONG))), param, False, options)
    frequencies = np.linspace(0, 2 * param.fc, len(used))[used]
    assert len(frequencies) > 5
    for frequency, found in zip(frequencies, theirs.reshape(len(position), -1).T.conj(), strict=True):
        (ours,) = spherical_waves(array, array.centres[20:21], position, 0, frequency)
        assert error(np.vdot(found, ours) / np.vdot(found, found) * found, ours) < 1e-4


def test_echoes_of_some_pass_a_filter_and_those_beside_the_array_are_left_out(array):
    position, amplitude = scatterers(40)
    passes, transfer = np.arange(40) % 2 == 0, np.exp(1e-7j * array.frequency)
    filtered, others = (array(position[own], amplitude[own]) for own in (passes, ~passes))
    found = array(position, amplitude, 0.0, (passes, transfer))
    assert error(found, filtered * transfer[:, None, None] + others) < 1e-5
    beside = position + [9e-3, 0, 0]
    assert not array.in_beam(beside).any() and not array(beside, amplitude).any()


def profile(volume, axis):
    """Envelope along an axis through its maximum."""
    index = [*np.unravel_index(volume.argmax(), volume.shape)]
    index[axis] = slice(None)
    return volume[tuple(index)]


def half_width(values, step):
    """Full width at half maximum, in the unit of the step."""
    above = np.flatnonzero(values > values.max() / 2)
    ends = [
        (first - (values[first] - values.max() / 2) / (values[first] - values[next_]))
        if next_ < first
        else (first + (values[first] - values.max() / 2) / (values[first] - values[next_]))
        for first, next_ in ((above[0], above[0] - 1), (above[-1], above[-1] + 1))
    ]
    return (ends[1] - ends[0]) * step


@pytest.mark.parametrize(
    ("point", "bounds"),
    [((0.0, 6.5e-3, 0.0), (90e-6, 250e-6, 250e-6)), ((2.3e-3, 8.8e-3, 3.0e-3), (95e-6, 280e-6, 280e-6))],
    ids=["on the axis", "in a corner"],
)
def test_point_is_sharp_and_where_it_is(point, bounds):
    scanner = VolumeScanner(configure(probe={"preset": "mouse_row_column_15MHz"}))
    lateral, axial, elevation = point
    around = np.arange(-28, 29) * 20e-6
    scanner.axial, scanner.elevation, scanner.lateral = axial + around / 2, elevation + around, lateral + around
    volume = np.abs(scanner.beamform(scanner.matrix(np.array([point]), np.ones(1))))
    assert np.unravel_index(volume.argmax(), volume.shape) == (28, 28, 28)
    for axis, (step, bound) in enumerate(zip((10e-6, 20e-6, 20e-6), bounds, strict=True)):
        assert half_width(profile(volume, axis), step) < bound

"""Lines of the scanner: where a point lands, how wide it is, and the statistics of speckle."""

import numba
import numpy as np
import pytest
from scipy.stats import kstest

from echotruth.config import Bmode, Probe, Rf
from echotruth.imaging.scanner import Scanner, imaging_depth

SPEED, CENTRE, SAMPLING = 1540.0, 25e6, 100e6
WAVELENGTH = SPEED / CENTRE
DEVIATION = 12.5e6 / np.sqrt(8 * np.log(2))


@pytest.fixture(scope="module")
def scanner():
    return Scanner(Probe(), Rf(lines=129), 9e-3)


@pytest.fixture(scope="module")
def narrow():
    return Scanner(Probe(), Rf(lines=61, sector_deg=24), 8e-3)


def at(depth, angle=0.0):
    return np.array([[depth * np.sin(angle), depth * np.cos(angle), 0.0]])


def full_width(place, profile):
    """Full width at half of the maximum, by linear interpolation."""
    peak = profile.argmax()
    half = profile.max() / 2
    left = np.interp(half, profile[: peak + 1], place[: peak + 1])
    return np.interp(-half, -profile[peak:], place[peak:]) - left


def exact_line(position, angle, ranges):
    """Float64 sum over all pairs of the Gaussian pulse at one line; demodulated at the centre frequency."""
    x = (np.arange(64) - 31.5) * 46e-6
    weight = np.cos(np.pi * x / (64 * 46e-6)) ** 2
    focus = 6.5e-3 * np.array([np.sin(angle), np.cos(angle)])
    delay = (6.5e-3 - np.hypot(focus[0] - x, focus[1])) / SPEED
    distance = np.hypot(position[0] - x, position[1])
    argument = np.pi * 41e-6 / WAVELENGTH * (position[0] - x) / distance
    one_way = weight * np.sin(argument) / argument * position[1] / distance**2
    line = np.zeros(len(ranges), complex)
    for i in range(64):
        received = (ranges + np.hypot(ranges * np.sin(angle) - x[i], ranges * np.cos(angle))) / SPEED
        late = received[:, None] - (distance[i] + distance) / SPEED - delay
        pulse = np.exp(-2 * (np.pi * DEVIATION * late) ** 2 + 2j * np.pi * CENTRE * late)
        line += one_way[i] * (pulse @ one_way)
    # Sum of the spectrum over the bins of an analytic signal.
    return line * np.exp(-4j * np.pi * CENTRE * ranges / SPEED) * 2 * DEVIATION * np.sqrt(2 * np.pi) / SAMPLING


@pytest.mark.parametrize("degrees", [0, 28])
def test_lines_are_the_exact_sum_over_all_pairs(scanner, degrees):
    line = np.abs(scanner.angle - np.radians(degrees)).argmin()
    position = at(6.5e-3, scanner.angle[line] + 0.01)
    near = slice(*np.searchsorted(scanner.range, [6.2e-3, 6.8e-3]))
    found = scanner.lines(position, np.ones(1))[line, near]
    exact = exact_line(position[0], scanner.angle[line], scanner.range[near])
    exact *= np.exp(4j * np.pi * (CENTRE - scanner.frequency) * scanner.range[near] / SPEED)
    assert np.linalg.norm(found - exact) < 0.01 * np.linalg.norm(exact)


@pytest.mark.parametrize("depth", [4e-3, 6.5e-3, 8.5e-3])
@pytest.mark.parametrize("degrees", [-20, 0, 11])
def test_point_lands_where_it_is(scanner, depth, degrees):
    line = np.abs(scanner.angle - np.radians(degrees)).argmin()
    image = np.abs(scanner.lines(at(depth, scanner.angle[line]), np.ones(1)))
    peak = np.unravel_index(image.argmax(), image.shape)
    below, top, above = image[line, peak[1] - 1 : peak[1] + 2]
    step = scanner.range[1] - scanner.range[0]
    place = scanner.range[peak[1]] + step * (below - above) / (2 * (below - 2 * top + above))
    assert peak[0] == line
    assert place == pytest.approx(depth, abs=WAVELENGTH / 20)


def test_lateral_width_in_focus_is_that_of_two_hann_apertures(narrow):
    """One way in focus the beam is the transform of the aperture, at the centre frequency; two ways, its square."""
    image = np.abs(narrow.lines(at(6.5e-3), np.ones(1)))
    found = full_width(6.5e-3 * np.sin(narrow.angle), image[:, np.abs(narrow.range - 6.5e-3).argmin()])
    x = (np.arange(64) - 31.5) * 46e-6
    sine = np.linspace(-0.05, 0.05, 2001)
    weight = np.cos(np.pi * x / (64 * 46e-6)) ** 2
    beam = np.abs(np.exp(2j * np.pi * np.outer(sine, x) / WAVELENGTH) @ weight) ** 2
    assert found == pytest.approx(full_width(6.5e-3 * sine, beam), rel=0.05)
    assert found == pytest.approx(202e-6, rel=0.03)


def test_axial_width_is_that_of_the_pulse(narrow):
    """A Gaussian spectrum of width B has an envelope of width 4 ln 2 / (pi B) in time."""
    image = np.abs(narrow.lines(at(6.5e-3), np.ones(1)))
    expected = 4 * np.log(2) / (np.pi * 12.5e6) * SPEED / 2
    assert full_width(narrow.range, image[30]) == pytest.approx(expected, rel=0.03)


def slab(seed, density):
    """Scatterers (density per cubic metre) in a box about the focus, as strong as each other and of either sign."""
    random = np.random.default_rng(seed)
    low, high = np.array([-1.9e-3, 5.4e-3, -0.4e-3]), np.array([1.9e-3, 7.6e-3, 0.4e-3])
    position = random.uniform(low, high, (int(density * np.prod(high - low)), 3))
    return position, random.choice([-1.0, 1.0], len(position))


def test_dense_speckle_is_fully_developed(narrow):
    """Envelope Rayleigh: mean over standard deviation sqrt(pi / (4 - pi)) = 1.91 (Wagner 1983)."""
    depth = np.flatnonzero((narrow.range > 5.7e-3) & (narrow.range < 7.3e-3))
    speckle = np.stack([np.abs(narrow.lines(*slab(seed, 15000e9)))[:, depth] for seed in range(10)])
    power = (speckle**2).mean(axis=0)
    speckle /= np.sqrt(np.outer(power.mean(axis=1), power.mean(axis=0)) / power.mean())
    # Ten lines are 4 degrees, two widths of the beam; ten samples are 77 um, two widths of the pulse.
    sample = speckle[:, ::10, ::10].ravel()
    assert sample.mean() / sample.std() == pytest.approx(1.91, abs=0.08)
    assert speckle.mean() / speckle.std() == pytest.approx(1.91, abs=0.04)
    assert kstest(sample, "rayleigh", args=(0, 1 / np.sqrt(2))).pvalue > 0.01


def test_sparse_speckle_has_the_kurtosis_of_its_density(narrow):
    """<I^2> / <I>^2 = 2 + 1 / (density * volume), the volume from the lines of a point (Jakeman 1980)."""
    depth = np.flatnonzero((narrow.range > 6e-3) & (narrow.range < 7e-3))
    point = np.abs(narrow.lines(at(6.5e-3), np.ones(1))) ** 2
    area = point.sum() ** 2 / (point**2).sum() * 6.5e-3 * np.radians(0.4) * (narrow.range[1] - narrow.range[0])
    elevation = np.linspace(-0.4e-3, 0.4e-3, 801)
    beam = np.sinc(elevation / (WAVELENGTH * 6.5)) ** 4
    volume = area * beam.sum() ** 2 / (beam**2).sum() * 1e-6
    intensity = np.stack([np.abs(narrow.lines(*slab(seed, 1000e9)))[:, depth] ** 2 for seed in range(20)])
    mean = intensity.mean(axis=(0, 2), keepdims=True)
    found = ((intensity / mean) ** 2).mean()
    assert found == pytest.approx(2 + 1 / (1000e9 * volume), rel=0.06)


def test_a_shift_in_depth_turns_the_phase(narrow):
    """The rays from the edges of the aperture are oblique and lower the turn by half a per cent."""
    shift = 5e-6
    lines = [narrow.lines(at(6.5e-3 + s), np.ones(1))[30] for s in (0, shift)]
    turn = np.angle(np.vdot(lines[0], lines[1]))
    assert -turn * SPEED / (4 * np.pi * narrow.frequency) == pytest.approx(shift, abs=WAVELENGTH / 1000)


def test_a_shift_of_the_phantom_shifts_the_speckle(narrow):
    position, amplitude = slab(3, 1000e9)
    step = narrow.range[1] - narrow.range[0]
    still, moved = (narrow.lines(position + np.array([0, s, 0]), amplitude)[20:41, 740:950] for s in (0, 3 * step))
    match = [
        np.corrcoef(np.abs(still[:, 5:-5]).ravel(), np.abs(moved[:, 5 + k : 205 + k]).ravel())[0, 1] for k in range(6)
    ]
    assert np.argmax(match) == 3
    assert match[3] > 0.99


def test_mirrored_scatterers_give_mirrored_lines(narrow):
    position, amplitude = slab(5, 200e9)
    lines = narrow.lines(position, amplitude)
    mirrored = narrow.lines(position * [-1, 1, 1], amplitude)[::-1]
    assert np.linalg.norm(lines - mirrored) < 2e-3 * np.linalg.norm(lines)


def test_line_bytes_do_not_depend_on_threads(narrow):
    position, amplitude = slab(6, 300e9)
    results = []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        results.append(narrow.lines(position, amplitude).tobytes())
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    assert results[0] == results[1]


def test_depth_reaches_the_corner_of_the_field_of_view_or_the_edge_of_the_sector():
    assert imaging_depth(Rf(sector_deg=64), Bmode()) == pytest.approx(np.hypot(12e-3, 6e-3))
    assert imaging_depth(Rf(sector_deg=40), Bmode()) == pytest.approx(12e-3 / np.cos(np.radians(20)))


@pytest.mark.parametrize(
    ("position", "amplitude", "complaint"),
    [
        (np.empty((0, 3)), np.empty(0), "no scatterers"),
        ([[0, np.nan, 0]], [1], "finite"),
        ([[0, 5e-3, 0]], [np.inf], "finite"),
        ([[0, -5e-3, 0]], [1], "in front"),
        ([[0, 5e-3]], [1], r"\(n, 3\)"),
        ([[0, 5e-3, 0]], [1, 2], r"\(n, 3\)"),
    ],
)
def test_bad_scatterers_are_refused(narrow, position, amplitude, complaint):
    with pytest.raises(ValueError, match=complaint):
        narrow.lines(position, amplitude)


@pytest.mark.parametrize("depth", [0, -1e-3, np.nan])
def test_bad_depth_is_refused(depth):
    with pytest.raises(ValueError, match="depth"):
        Scanner(Probe(), Rf(), depth)

"""Images of points: where they land, how wide they are, and how they move, against the exact sum over all pairs."""

import os
import subprocess
import sys

import numpy as np
import pytest

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.scanner import Scanner

SPEED, CENTRE = 1540.0, 25e6
WAVELENGTH = SPEED / CENTRE
DEVIATION = 12.5e6 / np.sqrt(8 * np.log(2))
LENGTH = 64 * 46e-6
X = (np.arange(64) - 31.5) * 46e-6
# An array so low that its beam in elevation is even: what is seen is that of the plane.
FLAT = Probe(height_mm=0.05)


@pytest.fixture(scope="module")
def narrow():
    return Scanner(FLAT, Rf(lines=61, sector_deg=24, focal_zones=1), 9e-3)


@pytest.fixture(scope="module")
def wide():
    return Scanner(FLAT, Rf(lines=129), 9e-3)


def at(depth, angle=0.0):
    return np.array([[depth * np.sin(angle), depth * np.cos(angle), 0.0]])


def peak_position(position, profile):
    """By the parabola through the largest value and its neighbours."""
    k = profile.argmax()
    below, top, above = profile[k - 1 : k + 2]
    return position[k] + (position[1] - position[0]) * (below - above) / (2 * (below - 2 * top + above))


def full_width(position, profile):
    """Full width at half of the maximum, by linear interpolation."""
    peak, half = profile.argmax(), profile.max() / 2
    left = np.interp(half, profile[: peak + 1], position[: peak + 1])
    return np.interp(-half, -profile[peak:], position[peak:]) - left


def exact(point, angle, ranges):
    """Focused line of a point (lateral, axial), float64: the sum over all pairs and frequencies, to the faintest one.

    Strip elements in a soft baffle, spherical spreading, Gaussian pulse cut at -40 dB, Hann weights.
    """
    frequency = CENTRE + DEVIATION * np.sqrt(2 * np.log(100)) * np.linspace(-1, 1, 1201)
    weight = np.cos(np.pi * X / LENGTH) ** 2
    distance = np.hypot(point[0] - X, point[1])
    turn = -2j * np.pi * frequency[:, None] / SPEED
    size = np.sinc(41e-6 * frequency[:, None] / SPEED * (point[0] - X) / distance) * point[1] / distance**2
    wave = size * weight * np.exp(turn * distance)
    focus = 6.5e-3 - np.hypot(6.5e-3 * np.sin(angle) - X, 6.5e-3 * np.cos(angle))
    pulse = np.exp(-((frequency - CENTRE) ** 2) / (2 * DEVIATION**2)) * (wave * np.exp(turn * focus)).sum(axis=1)
    line = np.empty(len(ranges), complex)
    for k, range_ in enumerate(ranges):
        path = range_ + np.hypot(range_ * np.sin(angle) - X, range_ * np.cos(angle))
        line[k] = pulse @ (wave * np.exp(-turn * path)).sum(axis=1)
    return line


@pytest.mark.parametrize("depth", [4e-3, 8.5e-3])
def test_lateral_and_axial_width_are_those_of_the_exact_sum(narrow, depth):
    image = np.abs(narrow.lines(at(depth), np.ones(1)))
    across, nearest = depth * np.sin(narrow.angle), np.abs(narrow.range - depth).argmin()
    lateral = [np.abs(exact((0, depth), angle, narrow.range[[nearest]]))[0] for angle in narrow.angle]
    assert full_width(across, image[:, nearest]) == pytest.approx(full_width(across, np.array(lateral)), rel=0.02)
    near = slice(nearest - 20, nearest + 21)
    axial = np.abs(exact((0, depth), 0.0, narrow.range[near]))
    found = full_width(narrow.range[near], image[30, near])
    assert found == pytest.approx(full_width(narrow.range[near], axial), rel=0.02)


@pytest.mark.parametrize(("depth", "degrees"), [(4e-3, -20), (6.5e-3, 0), (8.5e-3, 11)])
def test_a_point_lands_where_it_is(wide, depth, degrees):
    line = np.abs(wide.angle - np.radians(degrees)).argmin()
    image = np.abs(wide.lines(at(depth, wide.angle[line]), np.ones(1)))
    assert np.unravel_index(image.argmax(), image.shape)[0] == line
    assert peak_position(wide.range, image[line]) == pytest.approx(depth, abs=WAVELENGTH / 20)


@pytest.mark.parametrize(
    "keys",
    [{"transmit": "plane"}, {"transmit": "diverging"}, {"transmit": "synthetic_aperture"}, {"f_number": 2.0}],
    ids=lambda keys: str(next(iter(keys.values()))),
)
@pytest.mark.usefixtures("exact_record")
def test_every_transmit_puts_a_point_where_it_is(keys):
    """By the peak along line and range, and across the lines, to a twentieth of a wavelength and of a line's step."""
    scanner = Scanner(FLAT, Rf(lines=31, sector_deg=10, **keys), 6e-3)
    angle = scanner.angle[20] + 0.001
    image = np.abs(scanner.lines(at(5e-3, angle), np.ones(1)))
    line, sample = np.unravel_index(image.argmax(), image.shape)
    assert line == 20
    assert peak_position(scanner.range, image[line]) == pytest.approx(5e-3, abs=WAVELENGTH / 20)
    assert peak_position(scanner.angle, image[:, sample]) == pytest.approx(angle, abs=WAVELENGTH / 20 / 5e-3)


def slab(seed, number):
    """Scatterers in a part of the image plane about the focus, as strong as each other and of either sign."""
    random = np.random.default_rng(seed)
    position = random.uniform([-1.9e-3, 5.4e-3, 0], [1.9e-3, 7.6e-3, 0], (number, 3))
    return position, random.choice([-1.0, 1.0], number)


def test_the_phase_of_the_rf_recovers_an_axial_shift_of_speckle(narrow):
    shift = -3e-6
    position, amplitude = slab(0, 4000)
    part = slice(20, 41), slice(*np.searchsorted(narrow.range, [5.7e-3, 7.3e-3]))
    still, moved = (narrow.lines(position + [0, s, 0], amplitude)[part] for s in (0, shift))
    # On lines aside of the axis a shift in depth is less along the line.
    cosine = np.average(np.cos(narrow.angle[part[0]]), weights=np.linalg.norm(still, axis=1) ** 2)
    found = -np.angle(np.vdot(still, moved)) * SPEED / (4 * np.pi * narrow.frequency) / cosine
    assert found == pytest.approx(shift, abs=WAVELENGTH / 500)


TURN_LINES, TURN_LAGS, TURN_HALF = 61, np.arange(-2, 9), 16


def turned(seed, depth, pivot, shift):
    """A block of scatterers about a depth, turned about a pivot on the axis so that its middle moves by shift."""
    random = np.random.default_rng(seed)
    position = random.uniform([-1.5e-3, depth - 0.45e-3, 0], [1.5e-3, depth + 0.45e-3, 0], (1600, 3)) - [0, pivot, 0]
    angle = shift / (depth - pivot)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return position @ turn + [0, pivot, 0], random.standard_normal(len(position))


def correlation(still, moved, lag):
    """Correlation of the middle lines of two images (lines, ranges), a number of lines apart."""
    first = TURN_LINES // 2 - TURN_HALF - lag // 2
    parts = (image[k : k + 2 * TURN_HALF + 1] for image, k in ((still, first), (moved, first + lag)))
    return np.corrcoef(*(part.ravel() for part in parts))[0, 1]


def recovered_shift(depth, pivot, shift, blocks=16, **keys):
    """Lateral motion of speckle over that of its scatterers, by the correlation of the images of blocks."""
    rf = Rf(lines=TURN_LINES, sector_deg=18, elevation_beam=False, **keys)
    scanner = Scanner(Probe(elements=32, pitch_um=92.0), rf, depth + 1e-3)
    near = np.abs(scanner.range - depth) < 0.3e-3
    match = np.zeros(len(TURN_LAGS))
    for seed in range(blocks):
        pair = [np.abs(scanner.lines(*turned(seed, depth, pivot, s)))[:, near] for s in (-shift / 2, shift / 2)]
        match += [correlation(*pair, lag) for lag in TURN_LAGS]
    return peak_position(TURN_LAGS * (scanner.angle[1] - scanner.angle[0]) * depth, match) / shift


@pytest.mark.slow
def test_speckle_that_turns_off_the_middle_focus_moves_as_its_tissue_with_zones_and_slips_with_one():
    """Blocks turned by 70 um about a point 2 mm away (Kallel, Bertrand & Meunier 1994, IEEE Trans UFFC 41:105)."""
    depth, pivot = 4.5e-3, 6.5e-3
    assert recovered_shift(depth, pivot, 70e-6) == pytest.approx(1, abs=0.05)
    assert recovered_shift(depth, pivot, 70e-6, blocks=8, focal_zones=1) < 0.85


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


def test_a_sampling_below_the_band_is_refused():
    with pytest.raises(ValueError, match="sampling_MHz = 40"):
        Probe(sampling_MHz=40.0)


FRAME = """
import numpy as np
from hashlib import sha256
from echotruth.config import Probe
from echotruth.imaging.rf.full_matrix import FullMatrix
random = np.random.default_rng(0)
position = random.uniform([-3e-3, 3e-3, 0], [3e-3, 9e-3, 0], (400, 3))
echoes = FullMatrix(Probe(elements=12), 9e-3, elevation=False)(position, random.standard_normal(400))
print(sha256(echoes.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_code_compiled_anew_and_code_from_the_cache_give_the_same_bytes(tmp_path):
    surroundings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", FRAME]
    anew, cached = (subprocess.run(command, env=surroundings, capture_output=True, text=True, check=True) for _ in "ab")
    assert anew.stdout == cached.stdout != ""

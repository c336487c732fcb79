"""Borders: spread evenly over a surface, as loud as asked for across the beam, and quiet where they are tilted."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.config import Config
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.imaging.medium.borders import Border, border_amplitude, seed_border

CONFIG = Config.model_validate({"phantom": {"density_per_mm3": 3000.0}, "rf": {"focal_zones": 1, "lines": 16}})


@pytest.fixture(scope="module")
def heart(half_sphere, twisting_heart):
    """Half a sphere with radii of 2 and 3 mm, which doubles its size in the second frame."""
    displacement = np.stack([0 * half_sphere.nodes, half_sphere.nodes])
    arrays = {"geometry": {"endo": half_sphere.endo, "epi": half_sphere.epi}}
    return replace(
        twisting_heart, nodes=half_sphere.nodes, cells=half_sphere.cells, displacement=displacement, arrays=arrays
    )


def test_scatterers_are_spread_evenly_over_the_surface(heart):
    facets, xi = seed_border(CONFIG, heart, "epi", np.random.default_rng(2))
    position = Border(facets, xi, 1.0).positions(heart.nodes)
    probe = CONFIG.probe.si()
    expected = 2 * np.pi * (3e-3 * probe.frequency / probe.sound_speed) ** 2  # half a sphere, one per square wavelength
    assert abs(len(facets) - expected) < 5 * np.sqrt(expected) + 0.01 * expected
    np.testing.assert_allclose(np.linalg.norm(position, axis=1), 3e-3, rtol=2e-3)
    # The height of points that are even on a sphere is even.
    height = -position[:, 2] / 3e-3
    assert abs(height.mean() - 0.5) < 0.02 and abs(height.std() - 12**-0.5) < 0.02


def test_amplitude_grows_with_the_area(heart):
    facets, xi = seed_border(CONFIG, heart, "endo", np.random.default_rng(3))
    border = Border(facets, xi, 2.0)
    np.testing.assert_allclose(border.amplitudes(heart.positions(0), heart.nodes), 2.0)
    np.testing.assert_allclose(border.amplitudes(heart.positions(1), heart.nodes), 8.0)


def power(position, amplitude):
    """Mean power of the middle lines about the focus, in the range of half a pulse."""
    scanner = Scanner(CONFIG.probe, CONFIG.rf, imaging_depth(CONFIG.rf, CONFIG.bmode))
    lines = scanner.lines(position, amplitude)
    focus = CONFIG.rf.si().focus
    middle = np.argsort(np.abs(scanner.scan.angle))[:6]
    return lines[middle], np.abs(scanner.range - focus) < 0.4e-3, scanner


def test_flat_border_across_the_beam_has_its_level_and_a_tilted_one_has_not():
    random, focus = np.random.default_rng(4), CONFIG.rf.si().focus
    half = np.array([0.7e-3, 0.6e-3, 0.6e-3])
    number = random.poisson(3000e9 * np.prod(2 * half))
    muscle = random.uniform(-1, 1, (number, 3)) * half + [0, focus, 0]
    lines, near, _ = power(muscle, random.standard_normal(number))
    reference = np.mean(np.abs(lines[:, near]) ** 2)

    amplitude = border_amplitude(CONFIG, 10.0)
    probe = CONFIG.probe.si()
    count = random.poisson((probe.frequency / probe.sound_speed) ** 2 * 4 * half[0] * half[2])
    sheet = random.uniform(-1, 1, (count, 3)) * [half[0], 0, half[2]]
    levels = []
    for tilt in (0.0, 25.0):
        turn = np.radians(tilt)
        turned = np.column_stack([sheet[:, 0] * np.cos(turn), sheet[:, 0] * np.sin(turn), sheet[:, 2]]) + [0, focus, 0]
        lines, near, _ = power(turned, np.full(count, amplitude))
        levels.append(10 * np.log10(np.mean(np.max(np.abs(lines[:, near]) ** 2, axis=1)) / reference))
    assert levels[0] == pytest.approx(10, abs=3)
    assert levels[1] < levels[0] - 5
